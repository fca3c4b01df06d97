"""File formats that several features share: metres, seconds and Z up in the core, each file's own form outside."""
