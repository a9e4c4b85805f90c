/* Error against time, as a picture. */
#ifndef CLI_TRADE_PLOT_H
#define CLI_TRADE_PLOT_H

#include "trade.h"

#include <stdio.h>

/* Seconds of the bake stage for a million values. */
double trade_rate(const trade_work *work, const trade_subject *subject, const trade_run *run);

/* Writes an inline SVG: RMSE over time, both logarithmic; the Pareto front and Embree's curve as lines. */
void trade_plot_write(FILE *out, const trade_work *work, const trade_subject *subject);

#endif
