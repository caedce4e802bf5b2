"""Arrays of sensors under a moving load: forces, spikes as events, figures."""
