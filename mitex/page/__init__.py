"""One HTML file in which a texture grows on a mesh: the data in it, and the document around them.

The page's own parts are beside this file: `js`, `glsl`, `page.html` and `page.css`, which `document` joins.
"""

from mitex.page.content import Content, jpeg, thumbnail
from mitex.page.document import data_url, document
from mitex.page.packing import packed
from mitex.page.still import still_content, write_still
from mitex.page.surface import mesh_data, quantised

__all__ = [
    "Content",
    "data_url",
    "document",
    "jpeg",
    "mesh_data",
    "packed",
    "quantised",
    "still_content",
    "thumbnail",
    "write_still",
]
