"""pathspace: a physically based renderer built on the path-space form of the rendering equation.

>>> import pathspace as ps
>>> scene = ps.load("scenes/cornell-spheres.glb")          # doctest: +SKIP
>>> image = scene.render(integrator="bdpt", spp=64)        # doctest: +SKIP
>>> image.save("cornell.exr")                              # doctest: +SKIP

``image.rgb`` is a NumPy array (height, width, 3) of linear float32 radiances. The options of
:meth:`Scene.render` are those of the command line, ``pathspace render``, which comes with this package.
"""

from ._errors import Error, InputError, OutputError, PathspaceWarning, UsageError
from ._image import Image
from ._native import __version__
from ._progress import Progress
from ._scene import Scene, load

__all__ = [
    "Error",
    "Image",
    "InputError",
    "OutputError",
    "PathspaceWarning",
    "Progress",
    "Scene",
    "UsageError",
    "__version__",
    "load",
]
