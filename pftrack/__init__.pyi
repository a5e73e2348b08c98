# What `import pftrack` offers, for type checkers: names and modules, imported when they are asked for.

from pftrack import analysis as analysis
from pftrack import api as api
from pftrack import cli as cli
from pftrack import core as core
from pftrack import doctor as doctor
from pftrack import experiments as experiments
from pftrack import filters as filters
from pftrack import output as output
from pftrack import process as process
from pftrack import reproduce as reproduce
from pftrack import runs as runs
from pftrack import sources as sources
from pftrack import sweep as sweep
from pftrack import teaching as teaching
from pftrack import testing as testing
from pftrack import vision as vision
from pftrack.analysis.fitting import fit as fit
from pftrack.api import compare as compare
from pftrack.api import load as load
from pftrack.api import record as record
from pftrack.api import run as run
from pftrack.core.model.model import Model as Model
from pftrack.core.model.recipe import Recipe as Recipe
from pftrack.core.numerics.compiled import compiled as compiled
from pftrack.core.version import __version__ as __version__
from pftrack.experiments.experiment import Experiment as Experiment
from pftrack.experiments.own.code import slider as slider
from pftrack.filters.alone import filter as filter  # noqa: A004 - as users call it
from pftrack.output.exports.formats import show as show
from pftrack.runs.comparison import Comparison as Comparison
from pftrack.runs.run import Run as Run
