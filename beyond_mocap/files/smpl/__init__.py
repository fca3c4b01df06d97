"""Motion as SMPL, SMPL-H and SMPL-X store it (AMASS, GVHMR, ASAP): rotations of a known joint tree in an .npz."""
