/* The picture that programs look for, R, G and B, out of channels that have other names. */
#ifndef VSHI_PICTURE_H
#define VSHI_PICTURE_H

#include "image/planes.h"

/* Channels of an image that make up its picture. */
typedef struct vshi_picture {
    int32_t rgb[3];                   /* one channel each; -1: all three are vshi_grey_at() of those below */
    int32_t light_count;              /* channels shadow.NAME */
    int32_t lights[VSH_MAX_CHANNELS]; /* [light_count] */
    int32_t ao;                       /* -1: none */
} vshi_picture;

/* The picture of an image: its irradiance; where there is none, the mean of its lights' shadows times its AO.
 * False where it has none of these, or has channels R, G or B itself. */
bool vshi_picture_of(const vsh_image *image, vshi_picture *picture);

/* What it is made of, in a word: "irradiance", "shadow.sun * ao", "mean of 3 shadows". */
void vshi_picture_text(const vshi_picture *picture, const vsh_image *image, char *text, size_t capacity);

#endif
