"""Orders, previews, variants, quality of takes and what is out of date."""
