"""How it becomes seamless: smoothing of seams, time warp, the fit to the path, and limbs that reach for their
targets."""
