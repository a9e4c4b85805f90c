/* Points in the order of a curve that fills space. */
#ifndef VSHI_ORDER_H
#define VSHI_ORDER_H

#include "base/job.h"
#include "field/field.h"
#include "shade/view.h"

enum {
    VSHI_ORDER_MOST =
        VSH_QUERY_BATCH,  /* points at a time: their order is 16 MB; four times as many gain a tenth */
    VSHI_ORDER_BYTES = 16 /* a point */
};

/* Room for the order of up to `most` points, and the order itself. */
typedef struct vshi_order {
    uint32_t *point; /* [count], out: numbers from the first of the points, in the curve's order */
    void *memory;
    size_t most;
} vshi_order;

/* Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_order_create(size_t most, vshi_order *order, vsh_error *error);
void vshi_order_free(vshi_order *order);

/* Whether shading points first … first + count - 1 in the curve's order pays: whether those that follow each
 * other are mostly too far apart to share proofs. Looks at a few of them. */
bool vshi_order_pays(const vsh_field *field, const vshi_view *view, size_t first, size_t count);

/* Orders points first … first + count - 1, at most order->most of them, on the job's threads. Equal places
 * keep their order; points that are not finite come last. Errors: VSH_ERROR_CANCELLED, VSH_ERROR_MEMORY,
 * VSH_ERROR_INTERNAL. */
vsh_result vshi_order_points(vshi_job *job, const vsh_field *field, const vshi_view *view, size_t first,
                             size_t count, vshi_order *order, vsh_error *error);

#endif
