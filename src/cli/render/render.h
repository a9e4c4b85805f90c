/* vdbshade render: its settings, and what its camera sees. */
#ifndef CLI_RENDER_H
#define CLI_RENDER_H

#include "cli/bake/options.h"

enum { RENDER_MOST_LIGHTMAPS = 64 };

typedef struct render_settings {
    cli_bake_settings bake;     /* the scene, the output and the stats */
    vsh_render_options options; /* but for what follows from the scene */
    double orbit_deg, exposure;
    const char *lightmaps[RENDER_MOST_LIGHTMAPS];
    size_t lightmap_count;
    const char *pack; /* of the lightmaps, as of `bake`; NULL: their own names */
    bool has_camera, has_look_at, has_sky, transparent;
} render_settings;

typedef struct render_lightmap {
    vsh_image_file *file;
    vsh_image image;
    float *linear;                          /* R, G and B of an sRGB file; else NULL */
    const float *decoded[VSH_MAX_CHANNELS]; /* planes of such a file */
    const char *names[VSH_MAX_CHANNELS];    /* these two of an image that was unpacked */
    const float *planes[VSH_MAX_CHANNELS];
} render_lightmap;

/* Everything in the picture. */
typedef struct render_shown {
    vsh_surface *surfaces; /* [count]: of casters without triangles */
    size_t count;
    vsh_occluders *own; /* fields of the surfaces whose colours share a layer */
    render_lightmap *maps;
    size_t map_count;
    vsh_lit_meshes *lit; /* [lit_count]: receivers with lightmaps, and behind them casters with triangles */
    size_t lit_count;
} render_shown;

/* All of these return CLI_OK or an exit code, having said why. Free `shown`, zeroed at first, also after a
 * failure. */

/* Reads the lightmaps of the scene's first receivers. */
int render_read_lightmaps(const render_settings *settings, const cli_shading *shading, render_shown *shown);

/* Adds the triangles of every caster that has them, and for the others a surface for every layer's colour. */
int render_add_casters(const cli_shading *shading, render_shown *shown);

/* Places the camera as the settings say, or so that all of `shown` is seen. */
int render_place_camera(const render_settings *settings, const render_shown *shown, vsh_camera *camera);

void render_free_shown(render_shown *shown);

/* Whether any caster has no triangles, so that the picture shows its field. */
bool render_shows_fields(const vsh_scene *scene, const vsh_assets *assets);

#endif
