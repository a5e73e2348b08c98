"""The documentation as a site: the Markdown of `docs/`, references made from the program, pictures made by it.

`python -m tools.site` builds it into `build/site`; `make docs` first installs its dependencies. Sphinx builds the site.
The pages are plain Markdown and readable without it, so content that only the site can show is named in comments:

- `contents`: tables of contents, from the lists of links on each folder's `index.md`
- `inserts`: `<!-- picture NAME: words -->`, films, live pages, the references
- `python_pages`, `rest`, `command_line`, `glossary`: the references, from docstrings, OpenAPI, typer and the glossary
- `formulas`: formulas as MathML, by the reader of the lessons
- `offline`: no script within a page, no address of another host
- `conf`: the settings of Sphinx
"""
