"""A whole match: from a provider's file to everybody's motion and the ball, on one machine or many."""
