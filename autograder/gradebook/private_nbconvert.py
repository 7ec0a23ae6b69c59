"""Everything that the kit uses of nbconvert and that nbconvert has not promised to keep, in one place.

`tests/test_private_names.py` says which of these an update has moved; pyproject.toml keeps untested ones away.
"""

from __future__ import annotations

from typing import Any

from jinja2.bccache import BytecodeCache
from nbconvert.exporters import HTMLExporter
from nbconvert.filters.widgetsdatatypefilter import WidgetsDataTypeFilter


class LeanHTMLExporter(HTMLExporter):  # type: ignore[misc]
    """nbconvert's HTML in half the time, which is most of what a submission costs here.

    It compiles the templates once, and leaves out the second parsing of the page: that gives images without a
    description one, and nothing of a student's can become an image.
    """

    compiled: BytecodeCache
    """Where compiled templates are kept."""

    def colour(self) -> Any:
        """Return what colours code."""
        raise NotImplementedError

    def _create_environment(self) -> Any:
        environment = super()._create_environment()
        environment.bytecode_cache = self.compiled
        return environment

    def from_notebook_node(self, nb: Any, resources: dict[str, Any] | None = None, **kwargs: Any) -> Any:
        """Convert a notebook as HTMLExporter does before it parses its own page."""
        resources = self._init_resources(resources)
        self.register_filter("highlight_code", self.colour())
        self.register_filter(
            "filter_data_type",
            WidgetsDataTypeFilter(notebook_metadata=self._nb_metadata, parent=self, resources=resources),
        )
        return super(HTMLExporter, self).from_notebook_node(nb, resources, **kwargs)
