"""What a scene needs, what it leaves out, and what it will cost."""
