"""Teaching: lessons, lectures and classes, built on the server's core, which does not depend on them.

A *class* watches a lecturer's work and answers polls. A *follow* is a class on one to four sessions or a lesson, begun
by a lecturer. It exists in memory and ends with the server; only the counts of answers are stored, not who was there. A
*lesson* comes from the library; the server draws it, judges answers and computes its checks. A *lecture* lists lessons,
failures, sessions, comparisons and polls in order, each with its minutes, in one small Markdown file.

- `routes`: addresses and pages of lessons and lectures, and the entry point for the app
- `messages`: messages between pages and these routes
- `links`: signed links, short enough to type, and the addresses at which other machines reach this server
- `roles`: the lists of requests allowed to owner and follower
- `access`: the one place that checks link, seat and role, for every request and every websocket
- `follow`, `follows`, `class_routes`: one class and its people, all classes, and their addresses
- `polls`: a question to the class, and its answers
- `lessons`, `functions`: lessons, and their computations in other processes
- `lectures`: lectures, and their files
"""
