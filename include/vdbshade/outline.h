/* Outlines: areas of a plane bounded by closed contours, from images, from text in a font, from polygons.
 * They are extruded into casters, or are the casters of a flat scene (flat.h). */
#ifndef VDBSHADE_OUTLINE_H
#define VDBSHADE_OUTLINE_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* An area of the xy-plane, x to the right, y up, world units. Immutable; may be shared by threads. Free it
 * with vsh_outline_free(). */
typedef struct vsh_outline vsh_outline;

/* How an image becomes an outline. */
typedef struct vsh_mask_options {
    size_t struct_size;
    double width;        /* of the image, world units, > 0 … 1e15 */
    double height;       /* the same; 0: by the image's proportions, pixels being square */
    double threshold;    /* what is at least this is solid; finite. 0.5: half of an integer format's range */
    const char *channel; /* "alpha", "luminance" (Rec. 709 weights), "red", "green", "blue", or a channel of
                            the file by its name; NULL: alpha where the image has one that is not 1
                            everywhere, else luminance */
    int32_t invert;      /* nonzero: what is below the threshold is solid */
} vsh_mask_options;

static inline vsh_mask_options vsh_mask_options_default(void) {
    vsh_mask_options options = {sizeof(vsh_mask_options), 1.0, 0.0, 0.5, NULL, 0};
    return options;
}

/* The area of an image where a channel is at least the threshold. The image's middle is the origin, its first
 * row on top. Its border runs where values interpolated between the pixels' centres cross the threshold
 * (marching squares: Lorensen and Cline, 1987, in the plane), so that the edges of anti-aliased masks are
 * found to 0.09 pixels; an area that reaches the image's edge ends there. Values are taken as they are
 * stored, without a transfer curve. Files from strangers are for run->reader (base.h).
 * Errors:
 * - VSH_ERROR_ARGUMENT: path or outline NULL, options out of range, run;
 * - VSH_ERROR_INPUT: no channel of that name, a pixel that is not finite, nothing solid; as vsh_image_read();
 * - VSH_ERROR_READ, VSH_ERROR_UNSUPPORTED: as vsh_image_read();
 * - VSH_ERROR_LIMIT: as vsh_image_read(); run->memory_limit, more than 2^31 points;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_outline_from_image(const char *path, const vsh_mask_options *options,
                                          const vsh_run *run, vsh_outline **outline, vsh_error *error);

enum { VSH_ALIGN_LEFT = 0, VSH_ALIGN_CENTER = 1, VSH_ALIGN_RIGHT = 2 };

/* How letters become an outline. */
typedef struct vsh_text_options {
    size_t struct_size;
    double height;       /* of the font's em, world units, > 0 … 1e15; capitals are about 0.7 of it */
    double line_spacing; /* from baseline to baseline, as a multiple of the font's own, > 0 … 1e3 */
    int32_t align;       /* VSH_ALIGN_…: where lines lie to x = 0 */
} vsh_text_options;

static inline vsh_text_options vsh_text_options_default(void) {
    vsh_text_options options = {sizeof(vsh_text_options), 1.0, 1.0, VSH_ALIGN_LEFT};
    return options;
}

/* The area of a text's letters. `text` is UTF-8, lines end in "\n" or "\r\n"; the first baseline is y = 0.
 * `font` is a file of outlines that FreeType reads (TrueType, OpenType, Type 1 …), its first face. Letters
 * follow each other from left to right with the advance and the kerning ('kern' table) of the font, without
 * its substitutions: ligatures, and scripts whose letters change with their neighbours, are not shaped.
 * Curves become lines that are at most 2e-5 of the height away; letters that overlap become one area. Errors:
 * - VSH_ERROR_ARGUMENT: text, font or outline NULL, options out of range, run;
 * - VSH_ERROR_INPUT: text that is no UTF-8, is empty, has control characters, characters that the font has no
 *   glyph for, or nothing but blanks; a file that is no font, or is damaged;
 * - VSH_ERROR_READ: no such file, no permission, a folder;
 * - VSH_ERROR_UNSUPPORTED: a font of bitmaps;
 * - VSH_ERROR_LIMIT: more than 2^20 bytes of text; run->memory_limit, more than 2^31 points;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_outline_from_text(const char *text, const char *font, const vsh_text_options *options,
                                         const vsh_run *run, vsh_outline **outline, vsh_error *error);

/* The area that closed polygons wind around (the nonzero rule: one that lies in another and runs the other
 * way is a hole). `points` [sum of counts][2], world units, finite, at most 1e15 in size; `counts`
 * [contour_count]. The last point of each joins its first; contours may cross each other and themselves.
 * Errors: VSH_ERROR_ARGUMENT (an array or outline NULL, run), VSH_ERROR_INPUT (a point out of range, nothing
 * of any area), VSH_ERROR_LIMIT (run->memory_limit, more than 2^31 points), VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_outline_from_polygons(const double *points, const size_t *counts, size_t contour_count,
                                             const vsh_run *run, vsh_outline **outline, vsh_error *error);

/* An outline and where it stands. A view; nothing is owned. */
typedef struct vsh_outline_instance {
    const vsh_outline *outline; /* in a place of its own, or in several */
    const double *transform; /* [6], local to world, two rows of three (column 2 translates), may mirror and
                                scale unevenly, but not flatten; NULL: identity */
} vsh_outline_instance;

/* The union of outlines. Errors: VSH_ERROR_ARGUMENT (no instances, an outline that is NULL, a transform that
 * is not finite or flattens, run), VSH_ERROR_INPUT (a point moved beyond 1e15), VSH_ERROR_LIMIT
 * (run->memory_limit, more than 2^31 points), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_outline_unite(const vsh_outline_instance *instances, size_t instance_count,
                                     const vsh_run *run, vsh_outline **outline, vsh_error *error);

/* What an outline comes to. */
typedef struct vsh_outline_info {
    size_t contours;      /* closed polygons */
    size_t points;        /* of all of them */
    double area;          /* world units² */
    double bounds_min[2]; /* world units */
    double bounds_max[2];
    uint64_t bytes; /* in memory */
} vsh_outline_info;

/* Cannot fail. */
VSH_API void vsh_outline_get_info(const vsh_outline *outline, vsh_outline_info *info);

/* The points of contour `index`, [*count][2], which belong to the outline; the area lies to the left of the
 * way from each to the next, and from the last to the first. NULL and 0 for an index beyond the contours. */
VSH_API const double *vsh_outline_contour(const vsh_outline *outline, size_t index, size_t *count);

/* Signed distance to the outline at a point [2], negative inside; NaN where the point is not finite. Takes
 * time with the logarithm of the number of points. */
VSH_API double vsh_outline_distance(const vsh_outline *outline, const double point[2]);
VSH_API void vsh_outline_free(vsh_outline *outline); /* NULL does nothing */

#ifdef __cplusplus
}
#endif
#endif
