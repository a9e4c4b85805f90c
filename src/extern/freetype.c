#include "extern/freetype.h"

#include "base/input.h"
#include "base/try.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <ft2build.h>

#include FT_FREETYPE_H
#include FT_OUTLINE_H

struct vshi_font {
    FT_Library library;
    FT_Face face;
    double unit; /* of the font, em */
    const char *path;
};

static vsh_result fail(vsh_error *error, const char *path, FT_Error code) {
    if (code == FT_Err_Out_Of_Memory) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    if (code == FT_Err_Unknown_File_Format) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: is no font that FreeType reads", path);
    }
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: a damaged font: FreeType's error %#x", path,
                     (unsigned)code);
}

/* FreeType's own errors do not tell a missing file from a bad one. */
static vsh_result check_file(const char *path, vsh_error *error) {
    FILE *file;
    uint64_t size;
    VSHI_TRY(vshi_input_open(path, path, UINT64_MAX, &file, &size, error));
    fclose(file);
    return VSH_OK;
}

vsh_result vshi_font_open(const char *path, vshi_font **font, vsh_error *error) {
    *font = NULL;
    VSHI_TRY(check_file(path, error));
    vshi_font *opened = calloc(1, sizeof *opened);
    if (opened == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    opened->path = path;
    FT_Error code = FT_Init_FreeType(&opened->library);
    if (code == 0) {
        code = FT_New_Face(opened->library, path, 0, &opened->face);
    }
    vsh_result result = VSH_OK;
    if (code != 0) {
        result = fail(error, path, code);
    } else if (!FT_IS_SCALABLE(opened->face) || opened->face->units_per_EM == 0) {
        result = vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                           "%s: a font of bitmaps: its letters have no outlines", path);
    } else if (opened->face->charmap == NULL) {
        result =
            vshi_fail(error, VSH_ERROR_INPUT, "%s: a font without a table of Unicode's characters", path);
    }
    if (result != VSH_OK) {
        vshi_font_close(opened);
        return result;
    }
    opened->unit = 1.0 / opened->face->units_per_EM;
    *font = opened;
    return VSH_OK;
}

void vshi_font_close(vshi_font *font) {
    if (font == NULL) {
        return;
    }
    if (font->library != NULL) {
        FT_Done_FreeType(font->library); /* and the face */
    }
    free(font);
}

double vshi_font_line_height(const vshi_font *font) {
    const double height = font->face->height * font->unit;
    return height > 0.0 ? height : 1.2;
}

uint32_t vshi_font_glyph(const vshi_font *font, uint32_t character) {
    return FT_Get_Char_Index(font->face, character);
}

double vshi_font_kerning(const vshi_font *font, uint32_t left, uint32_t right) {
    FT_Vector by;
    if (!FT_HAS_KERNING(font->face) ||
        FT_Get_Kerning(font->face, left, right, FT_KERNING_UNSCALED, &by) != 0) {
        return 0.0;
    }
    return (double)by.x * font->unit;
}

typedef struct drawing {
    const vshi_pen *pen;
    double unit;
} drawing;

static void scale(const drawing *d, const FT_Vector *v, double point[2]) {
    point[0] = (double)v->x * d->unit;
    point[1] = (double)v->y * d->unit;
}

static int move_to(const FT_Vector *to, void *user) {
    const drawing *d = user;
    double p[2];
    scale(d, to, p);
    d->pen->move(d->pen->user, p);
    return 0;
}

static int line_to(const FT_Vector *to, void *user) {
    const drawing *d = user;
    double p[2];
    scale(d, to, p);
    d->pen->line(d->pen->user, p);
    return 0;
}

static int conic_to(const FT_Vector *control, const FT_Vector *to, void *user) {
    const drawing *d = user;
    double c[2], p[2];
    scale(d, control, c);
    scale(d, to, p);
    d->pen->conic(d->pen->user, c, p);
    return 0;
}

static int cubic_to(const FT_Vector *control1, const FT_Vector *control2, const FT_Vector *to, void *user) {
    const drawing *d = user;
    double c1[2], c2[2], p[2];
    scale(d, control1, c1);
    scale(d, control2, c2);
    scale(d, to, p);
    d->pen->cubic(d->pen->user, c1, c2, p);
    return 0;
}

vsh_result vshi_font_draw(vshi_font *font, uint32_t glyph, const vshi_pen *pen, double *advance,
                          vsh_error *error) {
    static const FT_Outline_Funcs functions = {move_to, line_to, conic_to, cubic_to, 0, 0};
    const FT_Error code = FT_Load_Glyph(font->face, glyph, FT_LOAD_NO_SCALE | FT_LOAD_NO_BITMAP);
    if (code != 0) {
        return fail(error, font->path, code);
    }
    const FT_GlyphSlot slot = font->face->glyph;
    if (slot->format != FT_GLYPH_FORMAT_OUTLINE) {
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: letter %u has no outline", font->path, glyph);
    }
    drawing d = {pen, font->unit};
    const FT_Error drawn = FT_Outline_Decompose(&slot->outline, &functions, &d);
    *advance = (double)slot->metrics.horiAdvance * font->unit;
    return drawn == 0 ? VSH_OK : fail(error, font->path, drawn);
}
