/* Which texels a chart touches. */
#ifndef VSHI_UNWRAP_MASK_H
#define VSHI_UNWRAP_MASK_H

#include "unwrap/patch.h"

/* Turns that are tried beside quarter turns: 11.25° each. */
enum { VSHI_ANGLES = 8, VSHI_QUARTERS = 4 };

/* A patch's box, by angle: its lowest corner and size. */
typedef struct vshi_boxes {
    double low[VSHI_ANGLES][2], size[VSHI_ANGLES][2];
} vshi_boxes;

/* How a patch lies on texels, before it has a place: uv times `matrix` plus `offset` is in texels from the
 * mask's corner. */
typedef struct vshi_fit {
    double matrix[2][2], offset[2];
    double uneven;         /* what one side is scaled more than the other */
    int32_t width, height; /* texels of its box */
} vshi_fit;

/* Texels that are touched in one row: begin … end - 1. */
typedef struct vshi_run {
    int32_t begin, end;
} vshi_run;

typedef struct vshi_mask {
    int32_t width, height;
    uint32_t *row;  /* [height + 1] in `runs` */
    vshi_run *runs; /* ascending, apart */
    uint64_t touched;
} vshi_mask;

/* Turns a patch's uv so that its box is the least, begins at 0 and is not higher than wide; and tells its
 * boxes. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_patch_straighten(vshi_patch *patch, vshi_boxes *boxes, vsh_error *error);

/* Whether a patch nearly fills its box at angle 0: other angles are of no use to it. */
bool vshi_patch_is_box(const vshi_patch *patch, const vshi_boxes *boxes);

/* Fits a patch at an angle and so many texels to its unit. A patch that nearly fills its box becomes a whole
 * number of texels wide and high, if its stretch stays within the limit. Its borders then lie near texels'
 * centres, so that a lookup between texels inside of it reads its own texels alone. */
vshi_fit vshi_mask_fit(const vshi_patch *patch, const vshi_boxes *boxes, int angle, double density,
                       double max_stretch);

/* The texels that triangles of the patch touch with more than their border. Errors: VSH_ERROR_MEMORY. Free
 * with vshi_mask_free(), after a failure too. */
vsh_result vshi_mask_make(const vshi_patch *patch, const vshi_fit *fit, vshi_mask *mask, vsh_error *error);
void vshi_mask_free(vshi_mask *mask);

/* Whether it has all texels of its box. */
static inline bool vshi_mask_is_box(const vshi_mask *mask) {
    return mask->touched == (uint64_t)mask->width * (uint64_t)mask->height;
}

/* The mask turned by 1 to 3 quarter turns anticlockwise. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_mask_turn(const vshi_mask *mask, int quarters, vshi_mask *turned, vsh_error *error);

/* Sets bits begin … end - 1 of a row. */
void vshi_bits_set(uint64_t *row, int32_t begin, int32_t end);

/* The first bit from x on that is `value`; `width` where there is none. */
int32_t vshi_bits_next(const uint64_t *row, int32_t x, int32_t width, bool value);

/* A point of the fit in the mask turned so: texels from its corner. */
void vshi_fit_turn(const vshi_fit *fit, int quarters, const double uv[2], double at[2]);

#endif
