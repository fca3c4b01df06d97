"""Labels as NLA strips and key moments as markers; the reference video."""
