/* How an image is to be written: what the checks found out. */
#ifndef VSHI_WRITE_PLAN_H
#define VSHI_WRITE_PLAN_H

#include "image/oiio.h"
#include "image/picture.h"

typedef struct vshi_write_plan {
    bool exr, png;                     /* the file's; or neither */
    vshi_format format;                /* where it is not EXR */
    int32_t bits;                      /* 8, 16 or 32 */
    vshi_planes planes;                /* without values; names are the image's, or static */
    int32_t channel[VSH_MAX_CHANNELS]; /* of the image, for each plane; -1: the plane's constant, or grey */
    vshi_picture picture;              /* where a plane is grey: what of */
} vshi_write_plan;

/* Whether images of this ending are written. */
bool vshi_image_is_written(const char *path);

/* Errors: as of vsh_image_check(), but for the disk's. */
vsh_result vshi_write_plan_make(const char *path, const vsh_image *image, const vsh_image_options *options,
                                vshi_write_plan *plan, vsh_error *error);

#endif
