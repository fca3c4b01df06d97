"""What a movement is: quaternions, skeletons, motions, tracks, contacts and mirroring. Needs numpy and scipy only."""
