"""Sphinx configuration. Building and reading the pages needs no network."""

from __future__ import annotations

import contextlib
import html
import logging as standard_logging
import re
import sys
import time
from importlib.metadata import version as installed_version
from pathlib import Path

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator
from sphinx_gallery.sorting import ExplicitOrder

for noisy in ("websockets", "OpenGL.acceleratesupport", "traitlets"):  # of 3-D, MuJoCo, notebooks
    standard_logging.getLogger(noisy).setLevel("WARNING")

logger = logging.getLogger(__name__)

HERE = Path(__file__).parent

project = "copsense"
author = "copsense developers"
copyright = "2026, copsense developers"
release = version = installed_version("copsense")

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
]
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
# autosummary writes pages with the first suffix whose parser may be that of reStructuredText.
source_suffix = {".rst": "restructuredtext", ".ipynb": "myst-nb", ".md": "myst-nb"}
# Notebooks have no outputs of their own: each runs at every build.
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_merge_streams = True
# The scraper below is a function, which the build cache cannot hold.
suppress_warnings = ["config.cache"]
exclude_patterns = ["gallery/**/*.ipynb"]

default_role = "code"
autosummary_ignore_module_all = False
templates_path = ["_templates"]
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_type_aliases = {"ArrayLike": "ArrayLike"}
autodoc_mock_imports = ["torch"]  # the page is the same where it is not installed
autodoc_preserve_defaults = True
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
python_use_unqualified_type_names = True

# Types that are documented elsewhere: without the network there is nothing to link them to.
ELSEWHERE = (
    *("coal", "collections", "dataclasses", "fractions", "jax", "jaxtyping", "matplotlib", "np"),
    *("numpy", "pandas", "pathlib", "pd", "pin", "pinocchio", "scipy", "torch", "typing", "xarray"),
    "xr",
)
nitpick_ignore_regex = [
    (r"py:.*", rf"({'|'.join(ELSEWHERE)})\..*"),
    # The parts of a type such as Float[np.ndarray, "nc 6"] or tuple[float, ...].
    (r"py:.*", r"ArrayLike|Float|WrenchPolicy|TypeAliasForwardRef|ndarray|'[^']*'|'|tuple\[.*"),
    (r"py:.*", r"Axes|Color|Figure|Panels|Path"),  # imported for type checkers alone
    # Type variables, and a type that only its module's own code sees.
    (r"py:class", r"copsense\.paper\.claims\.verdict\.(Subject|Other)"),
    (r"py:class", r"copsense\.content\.(Key|Value)|copsense\.labelled\.R|_Problem"),
    (r"py:class", r"copsense\.statics\.tie_breaks\.C"),
    (r"py:class", r"copsense\.batch\.postures\.coordinates\.Coordinates"),  # no page of its own
]


def keep_figures(block: object, block_vars: dict, gallery_conf: dict) -> str:
    """Save the figures that an example's block has made; the plots keep none in pyplot's state."""
    from matplotlib.figure import Figure
    from sphinx_gallery.scrapers import figure_rst

    seen = block_vars.setdefault("seen_figures", [])
    paths = []
    for value in block_vars["example_globals"].values():
        if isinstance(value, Figure) and not any(value is figure for figure in seen):
            seen.append(value)
            path = next(block_vars["image_path_iterator"])
            value.savefig(path, dpi=120)
            paths.append(path)
    return figure_rst(paths, gallery_conf["src_dir"])


def draw_as_copsense_does(gallery_conf: dict, file: str | None) -> None:
    """Give what an example draws itself the style of copsense's figures."""
    import matplotlib as mpl

    from copsense.plots.style import STYLE, colours

    own = colours(["minimum-torque", "minimum-wrench", "a", "b", "c", "d"]).values()
    mpl.rcParams.update(STYLE | {"axes.prop_cycle": mpl.cycler(color=list(own))})


sphinx_gallery_conf = {
    "image_scrapers": (keep_figures,),
    "examples_dirs": str(HERE.parent / "examples"),
    "gallery_dirs": "gallery",
    # Every example runs at every build.
    "filename_pattern": r"\.py$",
    "run_stale_examples": True,
    "capture_repr": ("_repr_html_",),  # not what Matplotlib's calls return
    "subsection_order": ExplicitOrder(
        [f"../examples/{folder}" for folder in ("share", "stand", "limits", "many", "time")]
    ),
    "within_subsection_order": "FileNameSortKey",
    "remove_config_comments": True,
    "download_all_examples": False,
    "reset_modules": (draw_as_copsense_does,),
    "show_signature": False,
    "write_computation_times": False,
    "show_memory": False,
}

html_theme = "furo"
html_title = "copsense"
html_static_path = ["_static"]
html_css_files = ["copsense.css"]
html_extra_path = ["llms.txt"]
html_search_scorer = str(HERE / "search_scorer.js")
html_copy_source = False
html_show_sphinx = False
html_math_renderer = "mathml"


def write_inline_math(translator: HTML5Translator, node: nodes.math) -> None:
    """Write a formula in the text as MathML, which browsers show without a script."""
    translator.body.append(as_mathml(node, as_block=False))
    raise nodes.SkipNode


def write_block_math(translator: HTML5Translator, node: nodes.math_block) -> None:
    """Write a displayed formula as MathML."""
    translator.body.append(f'<div class="math">{as_mathml(node, as_block=True)}</div>\n')
    raise nodes.SkipNode


# What TeX reads as one digit and docutils as a whole number: \tfrac12 f would print 12/f.
AMBIGUOUS = re.compile(r"\\[dt]?(?:frac|binom)(?!\s*\{)|[_^]\s*\d\d|\\sqrt\s*\d\d")


def as_mathml(node: nodes.Element, *, as_block: bool) -> str:
    """The MathML of a formula; one that docutils cannot read, or reads otherwise, is a warning."""
    tex = node.astext()
    unclear = AMBIGUOUS.search(tex)
    if unclear:
        logger.warning("braces are missing after %s in: %s", unclear[0], tex, location=node)
    try:
        return tex2mathml(tex, as_block=as_block)
    except MathError as error:
        logger.warning("%s In: %s", error, tex, location=node)
        return ""


def keep_sentence(
    app: Sphinx, what: str, name: str, subject: object, options: object, lines: list[str]
) -> None:
    """Stop napoleon from reading "Names: a list." on a property as a type and its description."""
    if what in {"attribute", "data", "property"}:
        lines[:0] = ["..", ""]  # an empty comment: the first line has no colon any more


def name_aliases(
    app: Sphinx,
    what: str,
    name: str,
    subject: object,
    options: object,
    signature: str | None,
    returns: str | None,
) -> tuple[str | None, str | None]:
    """Write the alias ArrayLike as that, inside other types too."""
    forward = re.compile(r"TypeAliasForwardRef\('(\w+)'\)")
    return signature and forward.sub(r"\1", signature), returns and forward.sub(r"\1", returns)


def write_tables(app: Sphinx, page: str, source: list[str]) -> None:
    """Put what is generated from the package's data in the place of its comment on the page."""
    if page != "errata":
        return
    from copsense.paper.claims import VERDICT_STANDARD
    from copsense.paper.report import errata_markdown

    standard = "\n".join(
        f"- *{verdict.value}*: {text}" for verdict, text in VERDICT_STANDARD.items()
    )
    for name, text in (("errata table", errata_markdown()), ("standard of verdicts", standard)):
        source[0], count = re.subn(
            rf"^% {name}: .*$", lambda _, text=text: text, source[0], flags=re.MULTILINE
        )
        if count != 1:
            logger.warning("docs/errata.md has %d places for its %s, not one", count, name)


OUTPUT = re.compile(
    r'(<div class="highlight-(?:console|text)[^"]*)("><div class="highlight"><pre>)(.*?)(</pre>)',
    flags=re.DOTALL,
)
CELL = re.compile(r"<td\b.*?</td>", flags=re.DOTALL)
NAME = re.compile(r'(?<=<span class="pre">)[^<]+')
BREAK = re.compile(r"(?<=[A-Za-z0-9])([._/:])(?=[A-Za-z0-9\[])")
COLUMNS = re.compile(r"\S {2,}\S")
ON_A_PHONE = 46  # columns of output beside its margins


def fit_in_width(app: Sphinx, page: str, template: str, context: dict, doctree: object) -> None:
    """Mark the long lines of outputs that have no columns, and outputs whose columns are wide.

    Names in tables may break after a dot, an underscore and the like.
    """

    def marked(block: re.Match) -> str:
        lines, wide = [], False
        for line in block[3].split("\n"):
            text = html.unescape(re.sub(r"<[^>]*>", "", line)).strip()
            long = len(text) > ON_A_PHONE
            table = bool(COLUMNS.search(text))
            wide |= long and table
            lines.append(f'<span class="sentence">{line}</span>' if long and not table else line)
        return block[1] + " wide-output" * wide + block[2] + "\n".join(lines) + block[4]

    def with_breaks(cell: re.Match) -> str:
        return NAME.sub(lambda name: BREAK.sub(r"\1<wbr>", name[0]), cell[0])

    if "body" in context:
        context["body"] = CELL.sub(with_breaks, OUTPUT.sub(marked, context["body"]))


def write_scenes(app: Sphinx, error: Exception | None) -> None:
    """Make the pages in 3-D by the code that scenes.md shows; megabytes that nobody commits."""
    if error is not None or app.builder.format != "html":
        return
    folder = Path(app.outdir) / "_static"
    folder.mkdir(exist_ok=True)
    for old in folder.glob("*-3d.html"):
        old.unlink()
    page = (HERE / "scenes.md").read_text("utf-8")
    code = "\n".join(re.findall(r"^```python\n(.*?)^```", page, flags=re.MULTILINE | re.DOTALL))
    with contextlib.chdir(folder):
        exec(compile(code, "scenes.md", "exec"), {"__name__": "scenes"})


# Stages of a build, seconds to minutes each: the event that begins one and ends the one before.
STAGES = (
    ("builder-inited", 0, "running the examples"),
    ("env-before-read-docs", 0, "reading the pages, running the notebooks"),
    ("write-started", 0, "writing the pages"),
    ("build-finished", 0, "making the scenes in 3-D"),
    ("build-finished", 1000, ""),
)


def show_stages(app: Sphinx) -> None:
    """Print a line for each stage of a build: what it does, then the seconds that it took."""
    began: list[float] = []

    def begin(name: str) -> None:
        if began:
            sys.stdout.write(f"  {time.monotonic() - began.pop():.0f} s\n")
        if name:
            sys.stdout.write(f"{name} ...\n")
            began.append(time.monotonic())
        sys.stdout.flush()

    for event, priority, name in STAGES:
        app.connect(event, lambda *_, name=name: begin(name), priority=priority)


def setup(app: Sphinx) -> None:
    """Register the MathML renderer and what prepares docstrings, and make pages in 3-D."""
    show_stages(app)
    app.connect("build-finished", write_scenes)
    app.connect("source-read", write_tables)
    app.connect("html-page-context", fit_in_width)
    app.connect("autodoc-process-docstring", keep_sentence, priority=100)
    app.connect("autodoc-process-signature", name_aliases)
    app.add_html_math_renderer("mathml", (write_inline_math, None), (write_block_math, None))
