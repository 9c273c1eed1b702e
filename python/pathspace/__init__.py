"""pathspace: a physically based renderer built on the path-space form of the rendering equation.

>>> import pathspace as ps
>>> scene = ps.load("scenes/cornell-spheres.glb")          # doctest: +SKIP
>>> image = scene.render(integrator="bdpt", spp=64)        # doctest: +SKIP
>>> image.save("cornell.exr")                              # doctest: +SKIP

``image.rgb`` is a NumPy array (height, width, 3) of linear float32 radiances. The options of
:meth:`Scene.render` are those of the command line, ``pathspace render``, which comes with this package.
"""

from ._build import Camera, Material, Mesh, PointLamp, SpotLamp, Sun
from ._errors import Error, InputError, OutputError, PathspaceWarning, UsageError
from ._image import Image
from ._native import __version__
from ._paths import TECHNIQUES, Merge, Path, Settings, Technique, Vertex
from ._progress import Progress
from ._reports import (
    Compared,
    CompareReport,
    Comparison,
    Contestant,
    ConvergeReport,
    Measured,
    Snapshot,
    VerifyReport,
    compare,
    converge,
    verify,
)
from ._scene import Scene, load
from ._shards import merge, render_shard

__all__ = [
    "TECHNIQUES",
    "Camera",
    "CompareReport",
    "Compared",
    "Comparison",
    "Contestant",
    "ConvergeReport",
    "Error",
    "Image",
    "InputError",
    "Material",
    "Measured",
    "Merge",
    "Mesh",
    "OutputError",
    "Path",
    "PathspaceWarning",
    "PointLamp",
    "Progress",
    "Scene",
    "Settings",
    "Snapshot",
    "SpotLamp",
    "Sun",
    "Technique",
    "UsageError",
    "VerifyReport",
    "Vertex",
    "__version__",
    "compare",
    "converge",
    "load",
    "merge",
    "render_shard",
    "verify",
]
