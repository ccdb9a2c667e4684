"""The physics: force laws, one grain's threshold, curves and measurements."""
