"""One HTML file in which a texture grows on a mesh: the data in it, and the document around them.

The page's own parts are beside this file: `js`, `glsl`, `page.html` and `page.css`, which `document` joins.
"""

from mitex.page.document import document, write_page
from mitex.page.packing import packed
from mitex.page.still import still_data, write_still
from mitex.page.surface import mesh_data, quantised

__all__ = ["document", "mesh_data", "packed", "quantised", "still_data", "write_page", "write_still"]
