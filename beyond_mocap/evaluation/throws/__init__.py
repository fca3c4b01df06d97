"""Throws and kicks from networks, measured as Fredriksson §4.5 has it, and compared by his tests.

- `deviation`    how far hands and feet are from where they were wanted (eq. 4.1)
- `impact`       where the ball goes that a moving hand lets go
- `compare`      one way of making motions against another, subject by subject: paired one-sided tests
- `subjects`     the figures of one way, subject by subject
- `fredriksson`  what his tables 8.1 to 8.8 print
- `tables`       those tables with ours beside his, as Markdown
"""
