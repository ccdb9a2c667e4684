// The bed line from the inlet to the outlet: x and z of each corner, m; cells from it to the
// next one, and the ratio of each of these to the one upstream of it.
bed_line() = {
  -0.2, 0.0, 11, 0.8385033999910586,
  0.0, 0.0, 20, 0.9365533128077692,
  0.07464101615137755, 0.02, 20, 1.0677448750910066,
  0.1492820323027551, 0.0, 14, 1.2054031154310403,
  0.5492820323027552, 0.0, 0, 1.0
};
