/* An outline: closed contours, and a tree over pieces of them.
 *
 * A leaf holds some segments that follow each other on one contour, and so does every node up to the whole
 * contour: it is a chain. Much follows for a chain from its two ends alone: how often it winds around a point
 * that it lies beside, and all the directions that it hides from a point that it lies before. Above the
 * contours the tree halves space. */
#ifndef VSHI_CASTER_OUTLINE_H
#define VSHI_CASTER_OUTLINE_H

#include "base/job.h"

#include <vdbshade/outline.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct vshi_point {
    double x, y;
} vshi_point;

typedef struct vshi_outline_node {
    double low[2], high[2];
    uint32_t first;    /* a chain's first point; its last is first + count */
    uint32_t count;    /* segments of a chain; 0: several contours */
    uint32_t children; /* number of the first of two that follow each other; 0: a leaf */
} vshi_outline_node;

struct vsh_outline {
    vshi_point *points; /* the contours one after the other, each with its first point again at its end */
    uint32_t *starts;   /* [contour_count + 1], into points */
    size_t contour_count;
    vshi_outline_node *nodes; /* nodes[0] is the root */
    size_t node_count;
    double area;
};

/* Children before their siblings' children: a walk keeps at most one node waiting a level. */
enum { VSHI_OUTLINE_STACK = 128 };

/* Magnitudes of points and sizes. */
#define VSHI_OUTLINE_LARGEST 1e15

/* Square of the distance to the nearest segment, or `bound` where that is less. */
double vshi_outline_square(const vsh_outline *outline, vshi_point p, double bound);

/* How often the contours wind around a point, anticlockwise. */
int64_t vshi_outline_winding(const vsh_outline *outline, vshi_point p);

/* --- making outlines */

/* Contours on the way to an outline. */
typedef struct vshi_contours {
    vshi_point *points;
    size_t point_count, point_capacity;
    uint32_t *starts; /* [contour_count + 1] once the first is closed */
    size_t contour_count, contour_capacity;
    const vsh_run *run; /* for its memory limit */
    vsh_error *error;
    vsh_result result; /* of the first failure; what follows it is left out */
} vshi_contours;

void vshi_contours_free(vshi_contours *contours);

/* The next point of the contour under way; one that equals its predecessor is left out. */
void vshi_contours_add(vshi_contours *contours, double x, double y);

/* Ends the contour; one of fewer than three points is left out. */
void vshi_contours_close(vshi_contours *contours);

/* Makes an outline of the contours, which are freed. `clean`: they neither cross nor lie in each other's
 * inside with the same sense, so that each is a border of the area; else they are made so (the nonzero rule).
 * `what` names it in messages. Errors: that of the contours; VSH_ERROR_INPUT where there is no area,
 * VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_contours_finish(vshi_contours *contours, bool clean, const char *what, vsh_outline **outline);

struct vshi_decoder;
struct vshi_encoder;

/* Parses in a reader, and puts what is handed over. */
vsh_result vshi_serve_text(const char *path, struct vshi_decoder *request, const vsh_run *run,
                           struct vshi_encoder *payload, vsh_error *error);

/* What a reader has handed over; everything in it is checked. Errors: VSH_ERROR_READ where it does not hold,
 * and as for what was made in this process. */
vsh_result vshi_contours_decode(struct vshi_decoder *decoder, vshi_contours *contours, const char *path,
                                vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
