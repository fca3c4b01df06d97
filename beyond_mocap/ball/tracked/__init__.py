"""The ball from tracking: who touched it where and when, and how it went between, solved from noisy samples."""
