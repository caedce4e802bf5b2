"""The bench window: state in, frames out."""
