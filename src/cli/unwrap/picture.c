#include "cli/message.h"
#include "unwrap.h"

#include "base/hash.h"

#include <math.h>
#include <stdlib.h>

/* A colour that is neither dark nor pale, and unlike that of the next chart. */
static void colour_of(uint32_t chart, float rgb[3]) {
    const uint64_t bits = vshi_mix(chart + UINT64_C(1));
    for (int k = 0; k < 3; ++k) {
        rgb[k] = 0.25F + 0.7F * (float)(bits >> (16 * k) & 0xffff) / 65535.0F;
    }
}

static double larger(double a, double b) {
    return a > b ? a : b;
}

static double smaller(double a, double b) {
    return a < b ? a : b;
}

/* A picture of pages below each other. */
typedef struct picture {
    float *planes[3];
    int32_t width, height;
    size_t *rows; /* [pages]: each one's first */
} picture;

/* Colours the texels whose centres a triangle has. */
static void paint(const picture *p, const vsh_atlas_page *page, size_t row, const double at[3][2],
                  const float rgb[3]) {
    const int32_t width = page->width, height = page->height;
    const double low[2] = {smaller(at[0][0], smaller(at[1][0], at[2][0])),
                           smaller(at[0][1], smaller(at[1][1], at[2][1]))};
    const double high[2] = {larger(at[0][0], larger(at[1][0], at[2][0])),
                            larger(at[0][1], larger(at[1][1], at[2][1]))};
    const int32_t x0 = (int32_t)larger(0.0, floor(low[0])), y0 = (int32_t)larger(0.0, floor(low[1]));
    const int32_t x1 = (int32_t)smaller(width, ceil(high[0])), y1 = (int32_t)smaller(height, ceil(high[1]));
    for (int32_t y = y0; y < y1; ++y) {
        for (int32_t x = x0; x < x1; ++x) {
            bool in = true;
            for (int k = 0; k < 3 && in; ++k) {
                const double *a = at[k], *b = at[(k + 1) % 3];
                in = (b[0] - a[0]) * (y + 0.5 - a[1]) - (b[1] - a[1]) * (x + 0.5 - a[0]) >= 0.0;
            }
            for (int k = 0; k < 3 && in; ++k) { /* pictures have v = 1 on top */
                p->planes[k][(row + (size_t)(height - 1 - y)) * (size_t)p->width + (size_t)x] = rgb[k];
            }
        }
    }
}

static void paint_mesh(const picture *p, const vsh_atlas *atlas, size_t mesh) {
    const vsh_atlas_mesh placed = vsh_atlas_mesh_view(atlas, mesh);
    for (size_t i = 0; i < placed.triangle_count; ++i) {
        const uint32_t chart = placed.charts[i];
        if (chart == VSH_NO_CHART) {
            continue;
        }
        const size_t number = vsh_atlas_charts(atlas)[chart].page;
        const vsh_atlas_page page = vsh_atlas_page_view(atlas, number);
        double at[3][2];
        float rgb[3];
        for (size_t k = 0; k < 3; ++k) {
            const float *uv = placed.uvs + 2 * (size_t)placed.indices[3 * i + k];
            at[k][0] = (double)uv[0] * page.width;
            at[k][1] = (double)uv[1] * page.height;
        }
        colour_of(chart, rgb);
        paint(p, &page, p->rows[number], (const double(*)[2])at, rgb);
    }
}

static int make(const vsh_atlas *atlas, picture *p) {
    const size_t pages = vsh_atlas_page_count(atlas);
    double width = 0.0, height = 0.0;
    p->rows = calloc(pages, sizeof *p->rows);
    if (p->rows == NULL) {
        return cli_out_of_memory("the picture");
    }
    for (size_t i = 0; i < pages; ++i) {
        const vsh_atlas_page page = vsh_atlas_page_view(atlas, i);
        p->rows[i] = (size_t)height;
        width = larger(width, page.width);
        height += page.height;
    }
    if (width * height * 3.0 > 0x1p31) {
        const vsh_error error = {VSH_ERROR_LIMIT,
                                 "--picture: more than 2^31 values: give fewer or smaller pages"};
        return cli_fail(&error);
    }
    p->width = (int32_t)width;
    p->height = (int32_t)height;
    for (int k = 0; k < 3; ++k) {
        p->planes[k] = calloc((size_t)p->width * (size_t)p->height, sizeof *p->planes[k]);
        if (p->planes[k] == NULL) {
            return cli_out_of_memory("the picture");
        }
    }
    return CLI_OK;
}

int cli_unwrap_write_picture(const char *path, const vsh_atlas *atlas) {
    static const char *const names[3] = {"R", "G", "B"};
    picture p = {.rows = NULL};
    int code = make(atlas, &p);
    if (code == CLI_OK) {
        for (size_t m = 0; m < vsh_atlas_mesh_count(atlas); ++m) {
            paint_mesh(&p, atlas, m);
        }
        const vsh_image image = {.width = p.width,
                                 .height = p.height,
                                 .channel_count = 3,
                                 .names = names,
                                 .planes = (const float *const *)p.planes};
        vsh_image_options options = vsh_image_options_default();
        options.bits = 8;
        vsh_error error;
        code = vsh_image_write(path, &image, &options, &error) == VSH_OK ? CLI_OK : cli_fail(&error);
    }
    for (int k = 0; k < 3; ++k) {
        free(p.planes[k]);
    }
    free(p.rows);
    return code;
}
