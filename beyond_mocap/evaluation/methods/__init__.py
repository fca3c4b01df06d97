"""Methods of synthesis side by side on a user's library and scenarios: the tables and curves of Faustino's thesis."""
