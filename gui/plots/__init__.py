"""What all plots of the window stand on: pyqtgraph in its look."""
