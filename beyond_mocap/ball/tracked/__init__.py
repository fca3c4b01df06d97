"""The ball from tracking data: who touched it where and when, and its trajectory in between, solved from noisy
samples.
"""
