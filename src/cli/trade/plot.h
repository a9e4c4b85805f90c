/* Error against time, as a picture. */
#ifndef CLI_TRADE_PLOT_H
#define CLI_TRADE_PLOT_H

#include "trade.h"

#include <stdio.h>

/* Writes an SVG, to stand in a page or alone: RMSE over time, both logarithmic; the runs of a method at a
 * voxel size, the Pareto front and Embree's rays as lines. */
void trade_plot_write(FILE *out, const trade_work *work, const trade_subject *subject);

#endif
