"""Following: a class sees what a lecturer does, asks nothing of the lecturer's run, and answers polls.

A *follow* is what a lecturer begins on one to four sessions or a lesson. It lives in memory alone and is gone with the
server; so is who was there. What was asked, and how many gave which answer, is kept.

- `links`: signed links, short enough to be typed, and the seats of those who came by them
- `roles`: what owner and follower may ask for, a list of all that is allowed
- `access`: the one place where link, seat and role are checked, for every request and every websocket
- `poll`, `places`, `listeners`: a question to the class, who is there, and what each is told
- `records`: what was answered, kept beyond the class
- `follow`, `follows`: one class, and all of them
- `addresses`: under which names other machines reach this one
"""

__all__: list[str] = []
