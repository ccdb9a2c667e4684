"""The numbers that can be a grain's, a fluid's, a bed's: what is outside is a slip of the pen.

These are the limits of nature, not of the methods: where a force law or a solver no longer holds is
known to `physics` and `fidelity`. SI units, but where a unit is given.
"""

from typing import Annotated

from pydantic import Field

Diameter = Annotated[float, Field(ge=1e-7, le=10)]
"""Smaller ones are carried by Brownian motion, and never lie; larger ones no flood has moved."""
Density = Annotated[float, Field(ge=0.1, le=25_000)]
"""From aerogels, 0.2, to osmium, 22,600."""
FluidDensity = Annotated[float, Field(ge=1e-7, le=20_000)]
"""From the vapour that ripples a comet to mercury, 13,500, and melts of metals."""
Viscosity = Annotated[float, Field(ge=1e-8, le=1e3)]
"""Kinematic. From liquid helium, 2e-8, to thin gases and lava."""
Gravity = Annotated[float, Field(ge=1e-6, le=1e4)]
"""From a small asteroid's to that of a centrifuge."""
Roughness = Annotated[float, Field(ge=1e-12, le=10)]
"""From far below any grain, where a wall is smooth, to the largest boulder."""
Height = Annotated[float, Field(ge=1e-6, le=1e4)]
"""From five of the smallest grains to the largest mountains."""
Speed = Annotated[float, Field(ge=1e-6, le=1e3)]
"""From creeping to supersonic, which no incompressible flow is."""
Length = Annotated[float, Field(ge=1e-12, le=1e4)]
"""Length of a mesh's cells, which resolve what the lengths above allow."""
OverHeight = Annotated[float, Field(ge=1e-4, le=100)]
"""A length over a pile's height: from far below a cell of any mesh to several piles."""
FormHeights = Annotated[float, Field(ge=3, le=1000)]
"""A length of the flow's domain over the height of the forms."""
RelativeSize = Annotated[float, Field(ge=0.1, le=10)]
"""A smaller grain falls through the pores of a bed, a larger one lies on many grains."""
FrictionAngle = Annotated[float, Field(ge=1, le=89)]
"""Degrees. From wet ice to grains that hold by more than friction."""
Slope = Annotated[float, Field(ge=0, lt=90)]
"""Degrees. The flow goes up it."""
LeeSlope = Annotated[float, Field(gt=0, le=60)]
"""Degrees. The grid lines of a mesh are vertical."""
EntrainmentAngle = Annotated[float, Field(ge=1, le=60)]
"""Degrees. At 60 the two grains below touch; at 0 the grain falls between them."""
LiftCoefficient = Annotated[float, Field(ge=0, le=100)]
"""From none to sixty times Saffman's."""
Stiffness = Annotated[float, Field(ge=1e2, le=1e9)]
"""Softer grains sink into one another by more than a hundredth; harder ones than of steel."""
Damping = Annotated[float, Field(ge=0, le=1)]
"""Over the critical one."""
