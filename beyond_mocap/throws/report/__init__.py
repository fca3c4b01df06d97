"""Throws and kicks from networks, measured as Fredriksson §4.5 has it.

- `deviation`    how far hands and feet are from where they were wanted (eq. 4.1)
- `impact`       where the ball goes that a moving hand lets go
- `compare`      paired one-sided tests
- `page`         the report (`strip`: a picture of its motions)
"""
