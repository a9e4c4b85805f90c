/* The outline of a text's letters. FreeType reads the font, in this process or in a reader. Curves are cut
 * into lines. */
#include "shapes/outline.h"

#include "base/elementary.h"
#include "base/file.h"
#include "base/floats.h"
#include "base/text.h"
#include "io/reader/reader.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include <ft2build.h>

#include FT_FREETYPE_H
#include FT_OUTLINE_H

static const size_t MAX_BYTES = (size_t)1 << 20;
/* Largest distance of lines from their curve, em. */
static const double TOLERANCE = 2e-5;
enum { MAX_LINES = 1024 /* of a curve */ };

/* Reads a character and moves *at behind it; UINT32_MAX if it is no UTF-8 (RFC 3629). */
static uint32_t next_character(const char **at) {
    const unsigned char *c = (const unsigned char *)*at;
    const size_t length = vshi_utf8_length(*at);
    uint32_t character = length > 1 ? c[0] & 0x7fu >> length : c[0];
    for (size_t i = 1; i < length; ++i) {
        character = character << 6 | (c[i] & 0x3f);
    }
    *at += length;
    return length > 0 ? character : UINT32_MAX;
}

/* --- fonts */

typedef struct layout {
    FT_Library library;
    FT_Face face;
    double unit; /* of the font, em */
    const char *path;
    double scale;
    double x, y;    /* origin of the letter, em */
    double last[2]; /* place of the pen, em */
    vshi_contours *contours;
} layout;

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

/* Opens the first face of a font file. FT_Done_FreeType() closes it, even after a failure. */
static vsh_result open_font(layout *l, vsh_error *error) {
    FILE *file;
    uint64_t size;
    /* FreeType's own errors do not distinguish a missing file from a bad one */
    VSHI_TRY(vshi_input_open(l->path, l->path, UINT64_MAX, &file, &size, error));
    fclose(file);
    FT_Error code = FT_Init_FreeType(&l->library);
    code = code == 0 ? FT_New_Face(l->library, l->path, 0, &l->face) : code;
    if (code != 0) {
        return fail(error, l->path, code);
    }
    if (!FT_IS_SCALABLE(l->face) || l->face->units_per_EM == 0) {
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: a font of bitmaps: its letters have no outlines",
                         l->path);
    }
    if (l->face->charmap == NULL) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: a font without a table of Unicode's characters",
                         l->path);
    }
    l->unit = 1.0 / l->face->units_per_EM;
    return VSH_OK;
}

/* From baseline to baseline, em. */
static double line_height(const layout *l) {
    const double height = l->face->height * l->unit;
    return height > 0.0 ? height : 1.2;
}

/* The distance, em, by which a letter moves when it follows another. */
static double kerning(const layout *l, uint32_t left, uint32_t right) {
    FT_Vector by;
    return FT_HAS_KERNING(l->face) && FT_Get_Kerning(l->face, left, right, FT_KERNING_UNSCALED, &by) == 0
               ? (double)by.x * l->unit
               : 0.0;
}

/* --- letters */

static void draw_to(layout *l, const double p[2]) {
    vshi_contours_add(l->contours, (l->x + p[0]) * l->scale, (l->y + p[1]) * l->scale);
    memcpy(l->last, p, sizeof l->last);
}

static void to_em(const layout *l, const FT_Vector *v, double p[2]) {
    p[0] = (double)v->x * l->unit;
    p[1] = (double)v->y * l->unit;
}

static int line_to(const FT_Vector *to, void *user) {
    layout *l = user;
    double p[2];
    to_em(l, to, p);
    draw_to(l, p);
    return 0;
}

static int move_to(const FT_Vector *to, void *user) {
    layout *l = user;
    vshi_contours_close(l->contours);
    return line_to(to, l);
}

/* Counts the lines for a curve. Its second derivative is at most `bend`, so its distance from a chord over a
 * part h of the parameter is at most bend h² / 8. */
static int count_lines(double bend) {
    const double count = ceil(sqrt(bend / (8.0 * TOLERANCE)));
    return count < 1.0 ? 1 : count < MAX_LINES ? (int)count : MAX_LINES;
}

static int cubic_to(const FT_Vector *control1, const FT_Vector *control2, const FT_Vector *end, void *user) {
    layout *l = user;
    const double from[2] = {l->last[0], l->last[1]};
    double c1[2], c2[2], to[2], bend = 0.0;
    to_em(l, control1, c1);
    to_em(l, control2, c2);
    to_em(l, end, to);
    for (int i = 0; i < 2; ++i) {
        const double first = fabs(from[i] - 2.0 * c1[i] + c2[i]), second = fabs(c1[i] - 2.0 * c2[i] + to[i]);
        bend = vshi_hypot(bend, 6.0 * fmax(first, second));
    }
    const int count = count_lines(bend);
    for (int k = 1; k < count; ++k) {
        const double t = (double)k / count, s = 1.0 - t;
        double p[2];
        for (int i = 0; i < 2; ++i) {
            p[i] =
                s * s * s * from[i] + 3.0 * s * s * t * c1[i] + 3.0 * s * t * t * c2[i] + t * t * t * to[i];
        }
        draw_to(l, p);
    }
    draw_to(l, to);
    return 0;
}

static int conic_to(const FT_Vector *middle, const FT_Vector *end, void *user) {
    layout *l = user;
    const double from[2] = {l->last[0], l->last[1]};
    double control[2], to[2];
    to_em(l, middle, control);
    to_em(l, end, to);
    const int count =
        count_lines(2.0 * vshi_hypot(from[0] - 2.0 * control[0] + to[0], from[1] - 2.0 * control[1] + to[1]));
    for (int k = 1; k < count; ++k) {
        const double t = (double)k / count, s = 1.0 - t;
        double p[2];
        for (int i = 0; i < 2; ++i) {
            p[i] = s * s * from[i] + 2.0 * s * t * control[i] + t * t * to[i];
        }
        draw_to(l, p);
    }
    draw_to(l, to);
    return 0;
}

/* Moves l->x along a line of text from `at` to `end`, and draws the letters if `draw`. */
static vsh_result lay_out_line(layout *l, const char *at, const char *end, bool draw, vsh_error *error) {
    static const FT_Outline_Funcs pen = {move_to, line_to, conic_to, cubic_to, 0, 0};
    uint32_t before = 0;
    while (at < end) {
        const uint32_t character = next_character(&at);
        const uint32_t glyph = FT_Get_Char_Index(l->face, character);
        if (glyph == 0) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s: the font has no letter for U+%04X", l->path,
                             character);
        }
        l->x += before != 0 ? kerning(l, before, glyph) : 0.0;
        const FT_Error code = FT_Load_Glyph(l->face, glyph, FT_LOAD_NO_SCALE | FT_LOAD_NO_BITMAP);
        if (code != 0) {
            return fail(error, l->path, code);
        }
        const FT_GlyphSlot slot = l->face->glyph;
        if (slot->format != FT_GLYPH_FORMAT_OUTLINE) {
            return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: letter %u has no outline", l->path, glyph);
        }
        const FT_Error drawn = draw ? FT_Outline_Decompose(&slot->outline, &pen, l) : 0;
        if (drawn != 0) {
            return fail(error, l->path, drawn);
        }
        vshi_contours_close(l->contours);
        VSHI_TRY(l->contours->result);
        l->x += (double)slot->metrics.horiAdvance * l->unit;
        before = glyph;
    }
    return VSH_OK;
}

static vsh_result draw_text(layout *l, const char *text, const vsh_text_options *options, vshi_job *job,
                            vsh_error *error) {
    const double share = options->align == VSH_ALIGN_LEFT     ? 0.0
                         : options->align == VSH_ALIGN_CENTER ? 0.5
                                                              : 1.0;
    for (const char *line = text; line != NULL;) {
        const char *end = strchr(line, '\n');
        const char *next = end != NULL ? end + 1 : NULL;
        end = end != NULL ? end : line + strlen(line);
        const size_t size = (size_t)(end - line) + (next != NULL);
        end -= end > line && end[-1] == '\r' && next != NULL;
        l->x = 0.0;
        if (share > 0.0) {
            VSHI_TRY(lay_out_line(l, line, end, false, error));
            l->x *= -share;
        }
        VSHI_TRY(lay_out_line(l, line, end, true, error));
        l->y -= options->line_spacing * line_height(l);
        VSHI_TRY(vshi_job_step(job, size, error));
        line = next;
    }
    return VSH_OK;
}

/* Draws a checked text with a font. Free the contours even after a failure. */
static vsh_result draw(const char *text, const char *path, const vsh_text_options *options,
                       const vsh_run *run, vshi_contours *contours, vsh_error *error) {
    layout l = {.path = path, .scale = options->height, .contours = contours};
    vshi_job *job = NULL;
    vsh_result result;
    VSHI_TRY_DONE(open_font(&l, error));
    VSHI_TRY_DONE(vshi_job_open(&job, run, "outline", strlen(text), path, error));
    result = draw_text(&l, text, options, job, error);
done:
    vshi_job_end(job);
    FT_Done_FreeType(l.library); /* and the face; NULL is an error that does nothing */
    return result;
}

/* --- in a reader process */

vsh_result vshi_serve_text(const char *path, vshi_decoder *request, const vsh_run *run, vshi_encoder *payload,
                           vsh_error *error) {
    vsh_text_options options = vsh_text_options_default();
    const char *text = vshi_decode_text(request, false);
    options.height = vshi_decode_number(request);
    options.line_spacing = vshi_decode_number(request);
    options.align = (int32_t)vshi_decode_count(request, VSH_ALIGN_RIGHT);
    if (text == NULL || !vshi_decoder_ends(request)) {
        return vshi_fail(error, VSH_ERROR_INTERNAL, "%s: the request to its reader is bad", path);
    }
    vshi_contours contours = {.run = run, .error = error};
    vsh_result result;
    VSHI_TRY_DONE(draw(text, path, &options, run, &contours, error));
    VSHI_TRY_DONE(contours.result);
    vshi_encode_count(payload, contours.contour_count);
    for (size_t c = 0; c < contours.contour_count; ++c) {
        const size_t begin = contours.starts[c], count = contours.starts[c + 1] - begin;
        vshi_encode_count(payload, count);
        vshi_encode_array(payload, contours.points + begin, count, sizeof *contours.points);
    }
done:
    vshi_contours_free(&contours);
    return result;
}

/* Each point passes the same checks as one that was drawn here. */
vsh_result vshi_contours_decode(vshi_decoder *decoder, vshi_contours *contours, const char *path,
                                vsh_error *error) {
    const uint64_t count = vshi_decode_count(decoder, UINT32_MAX);
    for (uint64_t c = 0; c < count && !decoder->bad; ++c) {
        const uint64_t size = vshi_decode_count(decoder, UINT32_MAX);
        const vshi_point *points = vshi_decode_array(decoder, size, sizeof *points);
        for (uint64_t i = 0; points != NULL && i < size; ++i) {
            vshi_contours_add(contours, points[i].x, points[i].y);
        }
        vshi_contours_close(contours);
        VSHI_TRY(contours->result);
    }
    return vshi_decoder_ends(decoder) && contours->contour_count == count
               ? VSH_OK
               : vshi_answer_fail(path, "its contours", error);
}

static vsh_result draw_by_reader(const char *text, const char *path, const vsh_text_options *options,
                                 const vsh_run *run, vshi_contours *contours, vsh_error *error) {
    enum { UNITS = 1000 };
    vshi_exchange exchange;
    vshi_answer answer;
    vshi_job *job;
    vsh_result result;
    VSHI_TRY(vshi_job_open(&job, run, "outline", UNITS, path, error));
    VSHI_TRY_DONE(vshi_exchange_begin(&exchange, VSHI_READ_TEXT, path, run, error));
    vshi_encode_text(&exchange.encoder, text);
    vshi_encode_number(&exchange.encoder, options->height);
    vshi_encode_number(&exchange.encoder, options->line_spacing);
    vshi_encode_count(&exchange.encoder, (uint64_t)options->align);
    VSHI_TRY_DONE(vshi_exchange_send_job(&exchange, job, UNITS, &answer, error));
    result = vshi_contours_decode(&answer.payload, contours, path, error);
    vshi_answer_free(&answer);
done:
    vshi_job_end(job);
    return result;
}

/* --- the public function */

static vsh_result check_text(const char *text, vsh_error *error) {
    const size_t size = strlen(text);
    if (size == 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "text: is empty");
    }
    if (size > MAX_BYTES) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "text: %zu bytes: expected at most %zu", size, MAX_BYTES);
    }
    const char *at = text;
    while (at < text + size) {
        const size_t place = (size_t)(at - text);
        const uint32_t character = next_character(&at);
        if (character == UINT32_MAX) {
            return vshi_fail(error, VSH_ERROR_INPUT, "text: is no UTF-8 at byte %zu", place);
        }
        const bool line_end = character == '\n' || (character == '\r' && *at == '\n');
        if ((character < 0x20 && !line_end) || (character >= 0x7f && character < 0xa0)) {
            return vshi_fail(error, VSH_ERROR_INPUT, "text: a control character, U+%04X, at byte %zu",
                             character, place);
        }
    }
    return VSH_OK;
}

static vsh_result check_options(const vsh_text_options *options, vsh_error *error) {
    if (!(options->height > 0.0 && options->height <= VSHI_OUTLINE_LARGEST)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "text: height %.9g: expected more than 0, at most %g",
                         options->height, VSHI_OUTLINE_LARGEST);
    }
    if (!(options->line_spacing > 0.0 && options->line_spacing <= 1e3)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "text: line_spacing %.9g: expected more than 0, at most 1000",
                         options->line_spacing);
    }
    if (vsh_get_name(VSH_NAMES_ALIGN, options->align) == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "text: align %d: expected 0 … %d", options->align,
                         VSH_ALIGN_RIGHT);
    }
    return VSH_OK;
}

vsh_result vshi_outline_from_text(const char *text, const char *font, const vsh_text_options *options,
                                  const vsh_run *run, vsh_outline **outline, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(outline);
    VSHI_NEEDS_BOTH(text, font);
    vsh_text_options full = vsh_text_options_default();
    vsh_run full_run;
    VSHI_TRY(vshi_options_resolve(options, &full, sizeof full, "vsh_text_options", error));
    VSHI_TRY(check_options(&full, error));
    VSHI_TRY(vshi_run_resolve(run, &full_run, error));
    VSHI_TRY(check_text(text, error));
    vshi_contours contours = {.run = &full_run, .error = error};
    const vsh_result result = full_run.reader != NULL
                                  ? draw_by_reader(text, font, &full, &full_run, &contours, error)
                                  : draw(text, font, &full, &full_run, &contours, error);
    if (result != VSH_OK) {
        vshi_contours_free(&contours);
        return result;
    }
    return vshi_contours_finish(&contours, false, "text", outline);
}
