"""The glossary: one meaning for each word that pages, messages and documentation use, declared as data.

Words that all experiments share stand here, and an experiment declares those of its own (`Experiment.terms`). The page
of the glossary, what pages say of a word that is pointed at, and the documentation are made of these declarations.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal


@dataclass(frozen=True, slots=True)
class Term:
    """A word and what it means.

    Attributes:
        name: The word as it stands in a sentence.
        meaning: What it means, a sentence without its full stop, for somebody who hears it for the first time.
        also: Other forms in which pages have it, such as its plural or a symbol.
    """

    name: str
    meaning: str
    also: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a form that is found everywhere, and a word that means nothing.

        Raises:
            ValueError: The name, the meaning or another form is blank.
        """
        if not all(text.strip() for text in (self.name, self.meaning, *self.also)):
            raise ValueError(f"a term needs a name, a meaning and no blank form, got {self}")


@dataclass(frozen=True, slots=True)
class Section:
    """Terms that belong together.

    Attributes:
        title: What they are about.
        terms: In the order in which they are best read.
    """

    title: str
    terms: tuple[Term, ...]


GLOSSARY = (
    Section(
        "What pftrack is made of",
        (
            Term(
                "experiment",
                "a source, trackers, parameters, a drawing and measures that belong together, under one name",
            ),
            Term("source", "gives any frame at any time: a recording or a simulated scene"),
            Term(
                "frame", "one moment of a source: its picture or table row, its time, and the truth where it is known"
            ),
            Term(
                "recording",
                "a video, an animated GIF, a set of pictures, a table of tracks, or what another tracker has computed",
            ),
            Term("scene", "a simulated world that a source shows; also the view in three dimensions of a session"),
            Term("target", "what a tracker follows"),
            Term(
                "tracker",
                "steps a state from one frame to the next by a method; what one chooses, compares and sweeps over",
                ("trackers",),
            ),
            Term(
                "method",
                "the mathematics, as books have it; several trackers may share one, and a tracker may join several",
                ("methods",),
            ),
            Term("filter", "the mathematics inside a tracker: bootstrap, auxiliary, Kalman and others"),
            Term(
                "particle filter",
                "a filter whose belief is many weighted guesses, so that it may have any shape",
                ("particle filters",),
            ),
            Term(
                "Kalman filter",
                "exact for a linear model with Gaussian noise; extended and unscented ones approximate others",
                ("Kalman filters",),
            ),
            Term("dynamics", "how a state is expected to move from one frame to the next, and how uncertain that is"),
            Term("run", "one source, one tracker, one seed, one timeline, from the first frame to the last"),
            Term("seed", "the number from which all random numbers of a run come"),
            Term("timeline", "the changes of parameters in a run, each with its frame"),
            Term("recipe", "everything that makes a run, as one text; it gives the same numbers on any machine"),
            Term("branch", "a run that shares the past of another run and differs from one frame on"),
            Term("parameter", "a value that you may set; a live parameter may change in the middle of a run"),
            Term("preset", "a tracker and values of parameters under a name"),
            Term("mark", "where the target is in one picture: a box, points, a line"),
            Term("footage", "in a recipe, the recording with its start and its mark"),
        ),
    ),
    Section(
        "What a tracker computes",
        (
            Term("state", "everything that a tracker knows after a frame"),
            Term("particle", "one guess of the target's state", ("particles",)),
            Term("weight", "how much a particle counts"),
            Term(
                "ESS",
                "effective sample size: how many equal particles would be worth as much as the weighted ones",
                ("effective sample size",),
            ),
            Term("likelihood", "how well a state explains a picture"),
            Term("prediction", "particles that move by the dynamics, without a look at the new picture"),
            Term("observation", "particles that come from the new picture"),
            Term("resampling", "drawing particles anew, in proportion to their weights"),
            Term("estimate", "the one state that a tracker reports for a frame"),
            Term("sigma", "the standard deviation of the estimate", ("noise σ",)),
            Term("log evidence", "the logarithm of how well the model expected the frames so far"),
            Term(
                "nat",
                "the unit of log evidence: one nat more makes what was seen 2.72 times as probable",
                ("nats",),
            ),
            Term("band", "an interval that should hold the truth in a given share of the frames"),
            Term("hypothesis", "one of several states that a tracker keeps at once", ("hypotheses",)),
            Term(
                "proposal",
                "where the particles of a frame come from: the prediction, the observation, or shares of both",
                ("proposals", "sampler", "samplers"),
            ),
            Term(
                "condensation",
                "the bootstrap filter of vision: all particles come from the prediction, and the picture weights them",
            ),
            Term(
                "threshold",
                "the value at which a tracker changes what it does; sigma and others are compared with it",
                ("thresholds", "limit"),
            ),
            Term("step", "one frame of tracking; as a number, the time that it took to compute", ("step time",)),
            Term(
                "ancestor",
                "the particle of an earlier frame that a particle was drawn from, by one resampling or several",
                ("ancestors", "descendant", "descendants"),
            ),
            Term(
                "genealogy",
                "the ancestors of the present particles; where their lines meet, they coalesce in one particle",
                ("coalesce", "coalescence"),
            ),
            Term("innovation", "a measurement less what the filter expected it to be"),
            Term("gain", "by how much an innovation moves the estimate of a Kalman filter"),
            Term(
                "normalised innovation squared",
                "the squared innovation in the deviations expected of it; a chi-square variable if the model holds",
                ("NIS",),
            ),
            Term(
                "normalised estimation error squared",
                "the squared error of the estimate in the deviations told; 1 a coordinate if these are right",
                ("NEES",),
            ),
            Term("residual", "what is found less what is expected of it", ("residuals",)),
            Term("mismatch", "how far a prediction is from what was measured, in standard deviations"),
            Term(
                "Gaussian",
                "the bell-shaped distribution; its mean and its covariance say all of it",
                ("Gaussians", "normal distribution"),
            ),
            Term(
                "covariance",
                "how far numbers vary and how far they vary together, as a matrix; drawn as an ellipse",
                ("covariances",),
            ),
            Term("prior", "what is believed of a state before the new picture is looked at", ("priors",)),
            Term(
                "posterior",
                "all that is believed of the state after a frame: the particles with their weights, or a Gaussian",
            ),
            Term(
                "smoothing",
                "an estimate of an earlier frame that uses the frames after it as well",
                ("smoothed", "smoother"),
            ),
            Term(
                "outlier",
                "a measurement that is wrong by far more than its noise explains",
                ("outliers",),
            ),
        ),
    ),
    Section(
        "How a run is judged",
        (
            Term("truth", "the true state of the target, known in a simulated scene or from a table"),
            Term("error", "distance between estimate and truth, in the unit of the experiment"),
            Term(
                "overlap",
                "intersection over union of two boxes, from 0 for boxes apart to 1 for the same box",
                ("IoU", "intersection over union"),
            ),
            Term(
                "held",
                "the run has its target in its last frames, by the truth, however often it was lost before",
                ("hold",),
            ),
            Term("lost", "the error is above the limit of the experiment; the truth decides"),
            Term("searching", "the tracker itself says that it has no target"),
            Term(
                "probability of being lost",
                "how probable it is that the target is lost, by the tracker's numbers; not calibrated on recordings",
                ("loss probability", "probability that the target is lost", "P(lost)"),
            ),
            Term("hidden", "something covers the target in this frame", ("occluded", "occlusion")),
            Term("measure", "one number for a whole run, such as the share of frames inside the true box"),
            Term("success", "a measure that the experiment names is good enough"),
            Term("suitability", "a number from 0 to 1: how well a tracker can follow a marked target"),
            Term("series", "what a tracker or an experiment measures in every frame"),
            Term("reading", "a line of numbers for one frame, beside the picture"),
            Term("failure", "a named way to fail, whose cause the diagnosis can tell from the run"),
            Term("diagnosis", "what went wrong with a run, since when, and the numbers that this is said from"),
            Term("sign", "that a cause of a loss is at work, by numbers of the run", ("signs",)),
            Term("cure", "the change with which a run no longer fails so"),
        ),
    ),
    Section(
        "Many runs",
        (
            Term("comparison", "two to four runs beside each other, in step"),
            Term("sweep", "a grid of conditions, each with several trials"),
            Term("axis", "a parameter that a sweep varies"),
            Term("condition", "one combination of the values of all axes"),
            Term("trial", "one of several seeds of a condition", ("trials",)),
            Term("pooled", "counted together, over all values of an axis that is not shown"),
            Term(
                "interval",
                "the range in which a value lies with the given probability, such as 95 %, as far as the runs tell",
                ("intervals", "95 % interval", "confidence interval"),
            ),
            Term(
                "Wilson interval",
                "the interval of a share that was counted in few runs; it stays within 0 and 1 and is true near both",
                ("Wilson's interval", "Wilson's"),
            ),
            Term(
                "baseline",
                "what changes are compared with: the same settings without a change, on the same seeds",
            ),
            Term(
                "McNemar's test",
                "how probable it is by chance alone that so many runs hold with one of two settings only, seed by seed",
                ("McNemar",),
            ),
            Term(
                "Holm's correction",
                "makes probabilities greater where several changes are tried, since one of many looks good by chance",
                ("Holm",),
            ),
            Term("median", "the middle value: half of the values are below it", ("medians",)),
            Term("ensemble", "runs of the same settings that differ in nothing but their seeds", ("other seeds",)),
            Term(
                "counterfactual",
                "what would have become of a run with one thing otherwise, found by repeating it with that change",
                ("counterfactuals", "what if"),
            ),
            Term("map", "a number for every condition, drawn over two axes"),
            Term("reproduction", "a published result, computed again"),
            Term("finding", "one line of a reproduction: their number, our number, and whether they agree"),
            Term(
                "reference implementation",
                "the second, independent program whose numbers the reproductions use where a publication has none",
            ),
        ),
    ),
    Section(
        "The dashboard",
        (
            Term("dashboard", "all pages that the server gives to a browser"),
            Term("session", "a run that somebody watches, with its branches and bookmarks"),
            Term("bookmark", "a frame of a session that somebody marked, with a note", ("bookmarks",)),
            Term("worker", "the process that computes a session"),
            Term("drawing", "what is drawn over a picture: points, lines, ellipses, in named layers"),
            Term("flat view", "the picture with its drawing, in two dimensions"),
            Term("scrubber", "the bar below a session that shows the whole run"),
            Term("upload", "a recording that somebody gave to the server"),
            Term(
                "keyframe",
                "a picture of a video that is stored whole, so that decoding can begin there",
                ("keyframes",),
            ),
            Term("saved run", "a run in a file (.pft)"),
            Term("export", "a file of another kind that is written from a run"),
            Term("manifest", "what an export says about itself: version, recipe, hashes, units, citation"),
            Term("lesson", "one idea on one page, with a question before the answer"),
            Term("class", "people who follow what a lecturer shows"),
            Term("lecture", "lessons, failures, sessions, comparisons and polls in an order, each with its minutes"),
            Term("poll", "a question to a class, with two to eight answers; who gave which is kept nowhere"),
            Term("follower", "one of them"),
            Term("copy", "a follower's own session that begins at the lecturer's frame; REST calls it a fork"),
            Term("base path", "what every address of a server begins with, for example /tracking"),
        ),
    ),
)
"""What all experiments share, by what it is about."""

# References: where methods and studies come from, as data that commands and pages can cite.
#
# An experiment names what it comes from as citations, each a reference and a place in it. The references that the
# project's own experiments share stand here; an experiment of another package brings its own.


@dataclass(frozen=True, slots=True)
class Reference:
    """A publication.

    Attributes:
        key: Its name in BibTeX.
        kind: Its type in BibTeX.
        authors: Full names, family name last.
        title: As printed.
        year: In which it appeared.
        where: Further fields of BibTeX: journal, volume, number and pages of an article; booktitle and pages of a
            paper; type, school and number of a dissertation; type and institution of a report; howpublished of what is
            else ("misc").
    """

    key: str
    kind: Literal["article", "inproceedings", "misc", "phdthesis", "techreport"]
    authors: tuple[str, ...]
    title: str
    year: int
    where: Mapping[str, str] = field(default_factory=dict)

    @property
    def short(self) -> str:
        """Family names and year."""
        names = [name.split()[-1] for name in self.authors]
        shown = " and ".join(names) if len(names) < 3 else f"{names[0]} et al."
        return f"{shown} {self.year}"

    @property
    def text(self) -> str:
        """The whole reference as plain text."""
        return f"{_join_names(self.authors)}: {self.title}. {self._publication}, {self.year}."

    def bibtex(self, note: str = "") -> str:
        """Return the entry of BibTeX.

        Args:
            note: What is cited of it, if that is not all.
        """
        fields = {
            "author": " and ".join(self.authors),
            "title": f"{{{self.title}}}",
            **self.where,
            "year": str(self.year),
            **({"note": note} if note else {}),
        }
        lines = "".join(f"  {name} = {{{value}}},\n" for name, value in fields.items())
        return f"@{self.kind}{{{self.key},\n{lines}}}\n"

    @property
    def _publication(self) -> str:
        where = dict(self.where)
        if self.kind != "article":
            return ", ".join(where.values()).replace("--", "-")
        volume = " ".join(filter(None, (where.get("journal"), where.get("volume"))))
        issue = f"({where['number']})" if "number" in where else ""
        pages = f", {where['pages'].replace('--', '-')}" if "pages" in where else ""
        return f"{volume}{issue}{pages}"


@dataclass(frozen=True, slots=True)
class Citation:
    """A place in a publication.

    Attributes:
        reference: The publication.
        place: Chapter or section with its title; all of it if empty.
    """

    reference: Reference
    place: str = ""

    @property
    def short(self) -> str:
        """Family names, year and place."""
        return ", ".join(filter(None, (self.reference.short, self.place)))

    @property
    def text(self) -> str:
        """The whole citation as plain text."""
        return f"{self.reference.text} {self.place[:1].upper()}{self.place[1:]}." if self.place else self.reference.text

    @property
    def bibtex(self) -> str:
        """The entry of BibTeX, with the place as its note."""
        return self.reference.bibtex(self.place[:1].upper() + self.place[1:])

    def as_dict(self) -> dict[str, str]:
        """Return all forms of it by name."""
        return {"key": self.reference.key, "short": self.short, "text": self.text, "bibtex": self.bibtex}


def _join_names(names: tuple[str, ...]) -> str:
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))


BANDO = Reference(
    "bando2007",
    "phdthesis",
    ("Takashi Bando",),
    "Adaptive Sampling Method for Real-time State Estimation in the Real World",
    2007,
    {
        "type": "Doctoral dissertation",
        "school": "Graduate School of Information Science, Nara Institute of Science and Technology",
        "number": "NAIST-IS-DD0461030",
    },
)
"""In Japanese with an English abstract."""

BANDO_2006 = Reference(
    "bando2006",
    "article",
    ("Takashi Bando", "Tomohiro Shibata", "Kenji Doya", "Shin Ishii"),
    "Switching particle filters for efficient visual tracking",
    2006,
    {"journal": "Robotics and Autonomous Systems", "volume": "54", "number": "10", "pages": "873--884"},
)

KAGAMI = Reference(
    "kagami2012",
    "misc",
    ("Shingo Kagami",),
    "Image tracking (3): Bayesian estimation and particle filters",
    2012,
    {"howpublished": "Lecture slides, Tohoku University"},
)
"""In Japanese."""

PEREZ = Reference(
    "perez2002",
    "inproceedings",
    ("Patrick Pérez", "Carine Hue", "Jaco Vermaak", "Michel Gangnet"),
    "Color-based probabilistic tracking",
    2002,
    {"booktitle": "European Conference on Computer Vision", "pages": "661--675"},
)

TOMASI = Reference(
    "tomasi1992",
    "article",
    ("Carlo Tomasi", "Takeo Kanade"),
    "Shape and motion from image streams under orthography: a factorization method",
    1992,
    {"journal": "International Journal of Computer Vision", "volume": "9", "number": "2", "pages": "137--154"},
)

BERNARDIN = Reference(
    "bernardin2008",
    "article",
    ("Keni Bernardin", "Rainer Stiefelhagen"),
    "Evaluating multiple object tracking performance: the CLEAR MOT metrics",
    2008,
    {"journal": "EURASIP Journal on Image and Video Processing", "volume": "2008", "pages": "246309"},
)

ICHIMURA = Reference(
    "ichimura2000",
    "techreport",
    ("Naoyuki Ichimura", "Norikazu Ikoma"),
    "Filtering of time series of feature point coordinates using non-Gaussian state space model",
    2000,
    {
        "type": "Technical report in Japanese",
        "institution": "Electrotechnical Laboratory and Kyushu Institute of Technology",
    },
)
"""It bears no year: it cites work of 1999, and the laboratory went by another name from 2001 on."""

KITAGAWA = Reference(
    "kitagawa1996",
    "article",
    ("Genshiro Kitagawa",),
    "Monte Carlo filter and smoother for non-Gaussian nonlinear state space models",
    1996,
    {"journal": "Journal of Computational and Graphical Statistics", "volume": "5", "number": "1", "pages": "1--25"},
)

MITSUGAMI = Reference(
    "mitsugami2009",
    "misc",
    ("Ikuhisa Mitsugami", "Koh Kakusho", "Michihiko Minoh"),
    "Efficient particle filtering for a non-rigid object based on PCA about changes of its shape and motion",
    2009,
    {"howpublished": "Journal paper in Japanese"},
)
"""In Japanese with an English abstract."""

SHIMADA = Reference(
    "shimada1997",
    "phdthesis",
    ("Nobutaka Shimada",),
    "Estimating the three-dimensional shape and pose of articulated objects from monocular image sequences",
    1997,
    {"type": "Doctoral dissertation in Japanese", "school": "Osaka University"},
)
"""In Japanese."""
