/* Error against time, as a picture. */
#ifndef CLI_TRADE_PLOT_H
#define CLI_TRADE_PLOT_H

#include "trade.h"

#include <stdio.h>

/* Microseconds that the bake takes for a value: a texel's share of one light, or its AO. */
double trade_rate(const trade_subject *subject, const trade_run *run);

/* Writes an SVG, to stand in a page or alone: RMSE over time, both logarithmic; the runs of a method at a
 * voxel size, the Pareto front and Embree's rays as lines. */
void trade_plot_write(FILE *out, const trade_work *work, const trade_subject *subject);

#endif
