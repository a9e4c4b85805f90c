/* What the parts of `vdbshade render` share. */
#ifndef CLI_RENDER_H
#define CLI_RENDER_H

#include "cli/bake/options.h"
#include "cli/provenance.h"

enum { RENDER_MOST_LIGHTMAPS = 64 };

typedef struct render_settings {
    cli_bake_settings bake; /* the scene, as `bake` takes it; its output and stats are ours */
    double camera[3], look_at[3], up[3];
    double fov_deg, orbit_deg;
    int32_t width, height, samples;
    double sky[3], background[3];
    double exposure, shafts;
    int32_t shaft_steps;
    const char *lightmaps[RENDER_MOST_LIGHTMAPS];
    size_t lightmap_count;
    const char *pack; /* of the lightmaps, as bake took it; NULL: their own names */
    bool has_camera, has_look_at, has_sky, transparent;
} render_settings;

/* Takes the command line, and checks what can be checked before anything is read. */
int render_parse(int argc, char **argv, render_settings *settings, bool *help);

/* --- what is seen (render_surfaces.c) */

typedef struct render_surfaces {
    vsh_surface *surfaces;
    size_t count;
    vsh_occluders *own;     /* of colours that share a layer */
    vsh_lit_meshes *meshes; /* [mesh_count]: of casters that are triangles, which are shown themselves */
    size_t mesh_count;
} render_surfaces;

/* Whether any caster has no triangles, so that the picture shows its field. */
bool render_shows_fields(const vsh_scene *scene, const vsh_assets *assets);

/* The triangles of every caster that has them, and for what has none a surface for every layer's colour.
 * CLI_OK or an exit code, having said why; free also after a failure. */
int render_surfaces_make(const vsh_scene *scene, const vsh_assets *assets, const vsh_occluders *occluders,
                         const vsh_run *run, render_surfaces *surfaces);
void render_surfaces_free(render_surfaces *surfaces);

/* A caster's color, or the default one (NULL too). */
void render_color_of(const vsh_caster *caster, double color[3]);

/* Places the camera as the settings say, or so that surfaces and the options' lit meshes are seen. CLI_OK or
 * an exit code, having said why (render_camera.c). */
int render_camera_place(const render_settings *settings, const render_surfaces *surfaces,
                        vsh_render_options *options);

/* --- lightmaps (render_lightmaps.c) */

typedef struct render_lightmap {
    vsh_image_file *file;
    vsh_image image;
    const char *names[VSH_MAX_CHANNELS]; /* as a pack has it */
    const float *planes[VSH_MAX_CHANNELS];
    float *linear; /* of R, G and B, where the file says that they are sRGB; else NULL */
    char text[VSH_CHANNEL_NAME * 4];
} render_lightmap;

typedef struct render_lightmaps {
    render_lightmap *maps;
    vsh_lit_meshes *lit;
    size_t count;
} render_lightmaps;

/* Reads the lightmaps of the scene's first receivers. CLI_OK or an exit code, having said why; free also
 * after a failure. */
int render_lightmaps_read(const render_settings *settings, const vsh_scene *scene, const vsh_assets *assets,
                          const vsh_run *run, render_lightmaps *lightmaps);
void render_lightmaps_free(render_lightmaps *lightmaps);

/* --- files (render_output.c) */

/* Planes of a picture, and those of the file. */
typedef struct render_picture {
    float *memory;
    vsh_picture picture;
    float *encoded[4];
    const cli_provenance *origin; /* of the file */
} render_picture;

/* What a picture takes while it is made and written. */
uint64_t render_picture_bytes(const render_settings *settings);

int render_picture_create(const render_settings *settings, const cli_provenance *origin,
                          render_picture *picture);
void render_picture_free(render_picture *picture);

/* Whether the picture can go to the output: CLI_OK or an exit code, having said why. */
int render_output_check(const render_settings *settings);

/* Writes the picture. CLI_OK or an exit code, having said why. */
int render_output_write(const render_settings *settings, const render_picture *picture);

#endif
