/* The border of a text's letters: laid out in lines, curves cut into lines. */
#include "base/elementary.h"
#include "outline/outline.h"

#include "base/floats.h"
#include "base/try.h"
#include "extern/freetype.h"

#include <math.h>
#include <string.h>

static const size_t MAX_BYTES = (size_t)1 << 20;
/* How far lines may be from the curve that they stand for, em. */
static const double TOLERANCE = 2e-5;
enum { MAX_LINES = 1024 /* of a curve */ };

/* --- UTF-8 */

/* The character at *at, which moves behind it; UINT32_MAX where there is no UTF-8 (RFC 3629). */
static uint32_t next_character(const char **at) {
    const unsigned char *c = (const unsigned char *)*at;
    const int more = c[0] < 0x80 ? 0 : c[0] >= 0xc2 && c[0] < 0xe0 ? 1 : (c[0] & 0xf0) == 0xe0 ? 2 : 3;
    if (more == 3 && (c[0] < 0xf0 || c[0] > 0xf4)) {
        return UINT32_MAX;
    }
    static const unsigned char masks[4] = {0x7f, 0x1f, 0x0f, 0x07};
    static const uint32_t least[4] = {0, 0x80, 0x800, 0x10000};
    uint32_t character = c[0] & masks[more];
    for (int i = 1; i <= more; ++i) {
        if ((c[i] & 0xc0) != 0x80) { /* the text's end, too */
            return UINT32_MAX;
        }
        character = character << 6 | (c[i] & 0x3f);
    }
    if (character < least[more] || character > 0x10ffff || (character >= 0xd800 && character < 0xe000)) {
        return UINT32_MAX;
    }
    *at += more + 1;
    return character;
}

/* --- letters */

typedef struct layout {
    vshi_font *font;
    const char *path;
    double scale;
    double x, y;    /* origin of the letter, em */
    double last[2]; /* where the pen is, em */
    vshi_contours *contours;
} layout;

static void put(layout *l, const double p[2]) {
    vshi_contours_add(l->contours, (l->x + p[0]) * l->scale, (l->y + p[1]) * l->scale);
    memcpy(l->last, p, sizeof l->last);
}

static void move_to(void *user, const double to[2]) {
    layout *l = user;
    vshi_contours_close(l->contours);
    put(l, to);
}

static void line_to(void *user, const double to[2]) {
    put(user, to);
}

/* How many lines keep a curve whose second derivative is at most `bend`: its distance from a chord over a
 * part h of the parameter is at most bend h² / 8. */
static int line_count(double bend) {
    const double count = ceil(sqrt(bend / (8.0 * TOLERANCE)));
    return count < 1.0 ? 1 : count < MAX_LINES ? (int)count : MAX_LINES;
}

static void cubic_to(void *user, const double c1[2], const double c2[2], const double to[2]) {
    layout *l = user;
    const double from[2] = {l->last[0], l->last[1]};
    double bend = 0.0;
    for (int i = 0; i < 2; ++i) {
        const double first = fabs(from[i] - 2.0 * c1[i] + c2[i]), second = fabs(c1[i] - 2.0 * c2[i] + to[i]);
        bend = vshi_hypot(bend, 6.0 * fmax(first, second));
    }
    const int count = line_count(bend);
    for (int k = 1; k < count; ++k) {
        const double t = (double)k / count, s = 1.0 - t;
        double p[2];
        for (int i = 0; i < 2; ++i) {
            p[i] =
                s * s * s * from[i] + 3.0 * s * s * t * c1[i] + 3.0 * s * t * t * c2[i] + t * t * t * to[i];
        }
        put(l, p);
    }
    put(l, to);
}

static void conic_to(void *user, const double control[2], const double to[2]) {
    layout *l = user;
    const double from[2] = {l->last[0], l->last[1]};
    const int count =
        line_count(2.0 * vshi_hypot(from[0] - 2.0 * control[0] + to[0], from[1] - 2.0 * control[1] + to[1]));
    for (int k = 1; k < count; ++k) {
        const double t = (double)k / count, s = 1.0 - t;
        double p[2];
        for (int i = 0; i < 2; ++i) {
            p[i] = s * s * from[i] + 2.0 * s * t * control[i] + t * t * to[i];
        }
        put(l, p);
    }
    put(l, to);
}

static void no_point(void *user, const double to[2]) {
    (void)user;
    (void)to;
}

static void no_conic(void *user, const double control[2], const double to[2]) {
    (void)user;
    (void)control;
    (void)to;
}

static void no_cubic(void *user, const double c1[2], const double c2[2], const double to[2]) {
    (void)user;
    (void)c1;
    (void)c2;
    (void)to;
}

/* Draws a line of text from `at` to `end` with a pen, from l->x on, which moves to its end. */
static vsh_result draw_line(layout *l, const char *at, const char *end, const vshi_pen *pen,
                            vsh_error *error) {
    uint32_t before = 0;
    while (at < end) {
        const uint32_t character = next_character(&at);
        const uint32_t glyph = vshi_font_glyph(l->font, character);
        if (glyph == 0) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s: the font has no letter for U+%04X", l->path,
                             character);
        }
        l->x += before != 0 ? vshi_font_kerning(l->font, before, glyph) : 0.0;
        double advance = 0.0;
        VSHI_TRY(vshi_font_draw(l->font, glyph, pen, &advance, error));
        vshi_contours_close(l->contours);
        VSHI_TRY(l->contours->result);
        l->x += advance;
        before = glyph;
    }
    return VSH_OK;
}

static vsh_result draw_text(layout *l, const char *text, const vsh_text_options *options, vshi_job *job,
                            vsh_error *error) {
    const vshi_pen none = {l, no_point, no_point, no_conic, no_cubic};
    const vshi_pen pen = {l, move_to, line_to, conic_to, cubic_to};
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
            VSHI_TRY(draw_line(l, line, end, &none, error));
            l->x *= -share;
        }
        VSHI_TRY(draw_line(l, line, end, &pen, error));
        l->y -= options->line_spacing * vshi_font_line_height(l->font);
        if (vshi_job_advance(job, size)) {
            return vshi_job_fail_cancelled(job, error);
        }
        line = next;
    }
    return VSH_OK;
}

/* --- from the outside */

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

vsh_result vshi_contours_draw(const char *text, const char *path, const vsh_text_options *options,
                              const vsh_run *run, vshi_contours *contours, vsh_error *error) {
    layout l = {.path = path, .scale = options->height, .contours = contours};
    VSHI_TRY(vshi_font_open(path, &l.font, error));
    vshi_job *job = vshi_job_begin(run, "outline", strlen(text));
    const vsh_result result = job != NULL
                                  ? draw_text(&l, text, options, job, error)
                                  : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    vshi_job_end(job);
    vshi_font_close(l.font);
    return result;
}

vsh_result vsh_outline_from_text(const char *text, const char *font, const vsh_text_options *options,
                                 const vsh_run *run, vsh_outline **outline, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(outline);
    *outline = NULL;
    VSHI_NEEDS(text);
    VSHI_NEEDS(font);
    vsh_text_options full = vsh_text_options_default();
    vsh_run full_run;
    VSHI_TRY(vshi_options_resolve(options, &full, sizeof full, "vsh_text_options", error));
    VSHI_TRY(check_options(&full, error));
    VSHI_TRY(vshi_run_resolve(run, &full_run, error));
    VSHI_TRY(check_text(text, error));
    vshi_contours contours = {.run = &full_run, .error = error};
    const vsh_result result = full_run.reader != NULL
                                  ? vshi_contours_from_reader(text, font, &full, &full_run, &contours, error)
                                  : vshi_contours_draw(text, font, &full, &full_run, &contours, error);
    if (result != VSH_OK) {
        vshi_contours_free(&contours);
        return result;
    }
    return vshi_contours_finish(&contours, false, "text", outline);
}
