"""A classifier two-sample test: whether takes can be distinguished from recordings, and by what (`comparison`)."""
