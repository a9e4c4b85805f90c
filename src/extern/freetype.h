/* Fonts: the outlines of their letters, through FreeType. */
#ifndef VSHI_FREETYPE_H
#define VSHI_FREETYPE_H

#include "base/error.h"

typedef struct vshi_font vshi_font;

/* Where a letter's outline is drawn to, in the font's em. Each contour begins with `move`. */
typedef struct vshi_pen {
    void *user;
    void (*move)(void *user, const double to[2]);
    void (*line)(void *user, const double to[2]);
    void (*conic)(void *user, const double control[2], const double to[2]);
    void (*cubic)(void *user, const double control1[2], const double control2[2], const double to[2]);
} vshi_pen;

/* Opens the first face of a font file. Close it with vshi_font_close(). One thread at a time. Errors: as
 * vsh_outline_from_text(). */
vsh_result vshi_font_open(const char *path, vshi_font **font, vsh_error *error);
void vshi_font_close(vshi_font *font); /* NULL does nothing */

/* From baseline to baseline, em. */
double vshi_font_line_height(const vshi_font *font);

/* Number of the letter for a character of Unicode; 0: there is none. */
uint32_t vshi_font_glyph(const vshi_font *font, uint32_t character);

/* What `right` is moved by when it follows `left`, em. */
double vshi_font_kerning(const vshi_font *font, uint32_t left, uint32_t right);

/* Draws a letter, its origin at (0, 0), and tells how far the next is from it, em. Errors: VSH_ERROR_INPUT,
 * VSH_ERROR_UNSUPPORTED (a bitmap), VSH_ERROR_MEMORY. */
vsh_result vshi_font_draw(vshi_font *font, uint32_t glyph, const vshi_pen *pen, double *advance,
                          vsh_error *error);

#endif
