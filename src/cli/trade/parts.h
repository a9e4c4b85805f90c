/* Parts of the report that are files of their own. */
#ifndef CLI_TRADE_PARTS_H
#define CLI_TRADE_PARTS_H

#include "trade.h"

#include <stdio.h>

/* Options as code, to be broken between them only. */
void trade_options_write(FILE *out, const char *options);

/* Truth, bake and difference of each run on the front, for the first receivers; ends the paragraph before. */
void trade_thumbnails_write(FILE *out, const trade_work *work, const trade_subject *subject);

/* The table as CSV, a row a run; `work` is a trade_work. */
void trade_rows_write(FILE *out, const void *work);

#endif
