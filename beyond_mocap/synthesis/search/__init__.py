"""Which clip frame is shown when: the searches `path`, `blocks` and `distance`, and their costs."""
