"""Teaching: lessons, lectures and classes, built on the server's core, which knows nothing of them.

A *class* sees what a lecturer does and answers polls. A *follow* is what a lecturer begins on one to four sessions or a
lesson. It lives in memory and ends with the server; nobody keeps who was there, only how many gave which answer. A
*lesson* is the library's; the server draws it, judges answers and computes its checks. A *lecture* lists lessons,
failures, sessions, comparisons and polls in order, each with its minutes, in one small Markdown file.

- `routes`: the addresses and pages of all of it, and what they work with: the app finds it here
- `messages`: what pages and these routes send each other
- `links`: signed links, short enough to be typed, and the names under which other machines reach this server
- `roles`: the list of all that owner and follower may request
- `access`: the one place that checks link, seat and role, for every request and every websocket
- `follow`, `follows`, `class_routes`: one class and its people, all of them, and their addresses
- `polls`: a question to the class, and its answers
- `lessons`, `functions`: lessons, and what other processes compute of them
- `lectures`: lectures, and their files
"""
