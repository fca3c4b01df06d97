"""Generated throws and kicks within longer motions."""
