// A triangular pile under a boundary layer: four blocks of hexahedra with vertical grid lines,
// one cell thick. x downstream from the windward toe, z upwards from the flat bed.
Include "parameters.geo";

Mesh.MshFileVersion = 2.2;  // gmshToFoam reads it
Mesh.Binary = 0;

slope = slope_deg*Pi/180;
If (slope_deg > 0)
  rise = height;
  face = height/Tan(slope);
Else
  rise = 0;
  face = 4*height;
EndIf
lid = 10*height;
upstream = 10*height;
downstream = 20*height;
thickness = height/10;

// twice the cells along a face: twice the cells everywhere, but the same first cell
growth = growth_at_40^(40/cells_per_face);

// the cells that begin with `first` and grow by `growth` until they fill `length`
Macro Count
  cells = Ceil(Log(1 + length*(growth - 1)/first)/Log(growth));
Return

// the ratio at which `cells` cells that begin with `first` fill `length` exactly
Macro Ratio
  low = 1 + 1e-9;
  high = 2;
  For bisection In {1:60}
    ratio = (low + high)/2;
    If (first*(ratio^cells - 1)/(ratio - 1) < length)
      low = ratio;
    Else
      high = ratio;
    EndIf
  EndFor
Return

// the faces: the cells at the crest, where the stress has its peak, are half as long as the mean
cells = cells_per_face;
length = face;
first = face/cells_per_face/2;
Call Ratio;
ratio_face = ratio;

// the flat bed before and behind goes on from the cell at the toe
first = first*ratio^(cells - 1);
length = upstream;
Call Count;
Call Ratio;
cells_upstream = cells;
ratio_upstream = ratio;
length = downstream;
Call Count;
Call Ratio;
cells_downstream = cells;
ratio_downstream = ratio;

// upwards: the grid lines are vertical, the height of the first cell is normal to the faces
first = first_cell/Cos(slope);
length = lid;
Call Count;
Call Ratio;
cells_up = cells;
ratio_flat = ratio;
length = lid - rise;
Call Ratio;
ratio_crest = ratio;

x() = {-upstream, 0, face, 2*face, 2*face + downstream};
z() = {0, 0, rise, 0, 0};
For i In {0:4}
  Point(1 + i) = {x(i), 0, z(i)};
  Point(11 + i) = {x(i), 0, lid};
  Line(21 + i) = {1 + i, 11 + i};
EndFor
For i In {0:3}
  Line(31 + i) = {1 + i, 2 + i};
  Line(41 + i) = {11 + i, 12 + i};
  Curve Loop(51 + i) = {31 + i, 22 + i, -(41 + i), -(21 + i)};
  Plane Surface(61 + i) = {51 + i};
EndFor
Transfinite Curve{21, 22, 24, 25} = cells_up + 1 Using Progression ratio_flat;
Transfinite Curve{23} = cells_up + 1 Using Progression ratio_crest;
Transfinite Curve{31, 41} = cells_upstream + 1 Using Progression 1/ratio_upstream;
Transfinite Curve{32, 42} = cells_per_face + 1 Using Progression 1/ratio_face;
Transfinite Curve{33, 43} = cells_per_face + 1 Using Progression ratio_face;
Transfinite Curve{34, 44} = cells_downstream + 1 Using Progression ratio_downstream;

far_side() = {};
air() = {};
bed() = {};
top() = {};
For i In {0:3}
  Transfinite Surface{61 + i} = {1 + i, 2 + i, 12 + i, 11 + i};
  Recombine Surface{61 + i};
  block() = Extrude {0, thickness, 0} { Surface{61 + i}; Layers{1}; Recombine; };
  far_side() += block(0);
  air() += block(1);
  bed() += block(2);
  top() += block(4);
  If (i == 0)
    inlet = block(5);
  EndIf
  If (i == 3)
    outlet = block(3);
  EndIf
EndFor

Physical Volume("air") = {air()};
Physical Surface("bed") = {bed()};
Physical Surface("lid") = {top()};
Physical Surface("inlet") = {inlet};
Physical Surface("outlet") = {outlet};
Physical Surface("sides") = {61:64, far_side()};
