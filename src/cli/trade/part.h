/* What a part of a trade keeps in its file (base/part_file.h). The body is a word for each texel, whose bit f
 * says whether it is valid on field f; then the values of each record, in their order, as
 * trade_subject.truth, and of auto its mask, a byte a texel up to a multiple of four. There is no tail. */
#ifndef CLI_TRADE_PART_H
#define CLI_TRADE_PART_H

#include "base/part_file.h"
#include "cli/provenance.h"
#include "trade.h"

#define TRADE_PART "trade" /* the kind of part */

/* What came of a task. */
typedef struct trade_record {
    uint64_t task;
    double build_s, bake_s;
    double certified; /* 0 … 1, or NaN */
    uint64_t bytes, valid;
} trade_record;

/* What is behind the vshi_part_about of a head. */
typedef struct trade_head {
    int32_t threads; /* that times are of: 0: all cores, 1: processor time */
    int32_t meshes;
    uint64_t tasks; /* these four of all parts alike */
    uint64_t texels, covered;
    uint64_t fields;
    uint64_t skipped; /* its own */
    double truth_s;
    trade_record *records; /* [record_count], owned, in the order of their tasks */
    uint64_t record_count;
} trade_head;

void trade_head_code(vshi_part_code *code, trade_head *head);

/* Bytes of a record's values, and of its mask; nonzero multiples of four, or 0. */
static inline uint64_t trade_values_bytes(const trade_work *work, const trade_task *task) {
    return (uint64_t)trade_task_planes(work, task) * work->texels * sizeof(float);
}
static inline uint64_t trade_mask_bytes(const trade_work *work, const trade_task *task) {
    return task->kind == TRADE_AUTO ? ((uint64_t)work->texels + 3) / 4 * 4 : 0;
}

/* Which part of what inputs and options; `origin` is to be freed, also after a failure. */
int trade_part_options(const trade_work *work, cli_provenance *origin, vsh_part_options *options);

#endif
