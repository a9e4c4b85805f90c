/* Options of the preview methods, for tests of cones. */
#pragma once

#include "testing.h"

#include <vdbshade/picture.h>

/* One cone a point, sixteen for AO, and 64 rays for tests that then choose a method with rays. */
static inline vsh_shade_options preview_options(void) {
    vsh_shade_options options = vsh_shade_options_default();
    options.method = VSH_SHADOW_CONE;
    options.ao_method = VSH_AO_CONES;
    options.rays = 64;
    return options;
}

static inline vsh_lightmap_options preview_lightmap_options(void) {
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.shade = preview_options();
    return options;
}

static inline vsh_volume_options preview_volume_options(void) {
    vsh_volume_options options = vsh_volume_options_default();
    options.shade = preview_options();
    return options;
}

static inline vsh_render_options preview_render_options(void) {
    vsh_render_options options = vsh_render_options_default();
    options.shade = preview_options();
    return options;
}
