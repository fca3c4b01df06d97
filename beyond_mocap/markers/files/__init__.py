"""Read and write files of optical markers (C3D, TRC), marker sets and MODEL.json."""
