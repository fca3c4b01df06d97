"""File formats that several features share: metres, seconds, Z up inside; each file's own form outside."""
