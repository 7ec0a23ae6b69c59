"""Questions about a student's own run, which nobody can answer who has not looked at this run.

`record` is what one launch did, `questions` asks about it, and `keys` has the right answers. Students get no `keys`.
"""
