"""What enters or leaves by disk, converted once at the border: metres, seconds, Z up inside; each file's own form
outside."""
