"""Read and write measurement files: one module per format."""
