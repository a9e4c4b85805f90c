/* An outline: closed contours, and a tree over pieces of them.
 *
 * A leaf, and every node up to a whole contour, holds successive segments of one contour: a chain. A chain's
 * two ends alone give its winding around a point outside its box. Above the contours the tree halves space.
 */
#pragma once

#include "base/job.h"

#include <vdbshade/mesh.h>

VSH_BEGIN_C

/* Makes the outline of the area of an image where a channel is at least the threshold. The image's middle is
 * the origin, its first row on top. The border runs where values interpolated between the pixels' centres
 * cross the threshold (marching squares: Lorensen and Cline, 1987, in the plane). This finds the edges of
 * anti-aliased masks to 0.09 pixels. The area ends at the image's edge. Stored values count, without a
 * transfer curve. Errors, beyond those of vsh_image_read():
 * - VSH_ERROR_ARGUMENT: path or outline NULL, options out of range;
 * - VSH_ERROR_INPUT: no channel of that name, a pixel that is not finite, nothing solid;
 * - VSH_ERROR_LIMIT: run->memory_limit, more than 2^31 points;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_outline_from_image(const char *path, const vsh_mask_options *options, const vsh_run *run,
                                   vsh_outline **outline, vsh_error *error);

/* Makes the outline of a text's letters. `text` is UTF-8, and its lines end in "\n" or "\r\n"; the first
 * baseline is y = 0. `font` is a file of outlines that FreeType reads (TrueType, OpenType, Type 1 …); its
 * first face counts. Letters follow each other from left to right with the advance and the kerning ('kern'
 * table) of the font. Its substitutions, such as ligatures, do not apply. Curves become lines that are at
 * most 2e-5 of the height away. Letters that overlap become one area. Errors:
 * - VSH_ERROR_ARGUMENT: text, font or outline NULL, options out of range, run;
 * - VSH_ERROR_INPUT: text that is not UTF-8, has control characters, or nothing but blanks. A character
 *   without a glyph in the font. A file that is damaged or no font;
 * - VSH_ERROR_READ: no such file, no permission, a folder;
 * - VSH_ERROR_UNSUPPORTED: a font of bitmaps;
 * - VSH_ERROR_LIMIT: more than 2^20 bytes of text; run->memory_limit, more than 2^31 points;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_outline_from_text(const char *text, const char *font, const vsh_text_options *options,
                                  const vsh_run *run, vsh_outline **outline, vsh_error *error);

/* An outline and where it stands. A view; nothing is owned. */
typedef struct vshi_outline_instance {
    const vsh_outline *outline; /* in a place of its own, or in several */
    const double *transform; /* [6], local to world, two rows of three (column 2 translates), may mirror and
                                scale unevenly, but not flatten; NULL: identity */
} vshi_outline_instance;

/* The union of one outline or more. Errors: VSH_ERROR_ARGUMENT (a transform that is not finite or flattens),
 * VSH_ERROR_INPUT (a point moved beyond 1e15), VSH_ERROR_LIMIT (run->memory_limit, more than 2^31 points),
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_outline_unite(const vshi_outline_instance *instances, size_t instance_count,
                              const vsh_run *run, vsh_outline **outline, vsh_error *error);

typedef struct vshi_outline_info {
    size_t contours;      /* closed polygons */
    size_t points;        /* of all contours */
    double area;          /* world units² */
    double bounds_min[2]; /* world units */
    double bounds_max[2];
    uint64_t bytes; /* in memory */
} vshi_outline_info;

void vshi_outline_get_info(const vsh_outline *outline, vshi_outline_info *info);

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

/* Walks visit children before their siblings' children, so at most one node a level waits. */
enum { VSHI_OUTLINE_STACK = 128 };

/* Largest magnitude of points and sizes. */
#define VSHI_OUTLINE_LARGEST 1e15

/* Square of the distance to the nearest segment, but at most `bound`. */
double vshi_outline_square(const vsh_outline *outline, vshi_point p, double bound);

/* Counts how often the contours wind around a point, anticlockwise. */
int64_t vshi_outline_winding(const vsh_outline *outline, vshi_point p);

/* --- making outlines */

/* Contours of an outline under construction. */
typedef struct vshi_contours {
    vshi_point *points;
    size_t point_count, point_capacity;
    uint32_t *starts; /* [contour_count + 1] once the first is closed */
    size_t contour_count, contour_capacity;
    const vsh_run *run; /* for its memory limit */
    vsh_error *error;
    vsh_result result; /* of the first failure; later points are ignored */
} vshi_contours;

void vshi_contours_free(vshi_contours *contours);

/* Adds a point to the open contour, unless it equals its predecessor. */
void vshi_contours_add(vshi_contours *contours, double x, double y);

/* Ends the contour, and drops it if it has fewer than three points. */
void vshi_contours_close(vshi_contours *contours);

/* Makes an outline of the contours, and frees them. `clean`: every contour is a border of the area, because
 * contours neither cross nor nest with the same sense. Otherwise the nonzero rule decides what is inside.
 * `what` names the outline in messages. Errors: that of the contours; VSH_ERROR_INPUT without an area,
 * VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_contours_finish(vshi_contours *contours, bool clean, const char *what, vsh_outline **outline);

struct vshi_decoder;
struct vshi_encoder;

/* A vshi_serve_fn for VSHI_READ_TEXT. */
vsh_result vshi_serve_text(const char *path, struct vshi_decoder *request, const vsh_run *run,
                           struct vshi_encoder *payload, vsh_error *error);

/* Decodes a reader's contours, and checks everything in them. Errors: VSH_ERROR_READ for a bad message, and
 * as for contours made in this process. */
vsh_result vshi_contours_decode(struct vshi_decoder *decoder, vshi_contours *contours, const char *path,
                                vsh_error *error);

VSH_END_C
