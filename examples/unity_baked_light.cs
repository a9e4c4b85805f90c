// Sets lightmaps and shadow masks of vdbshade (docs/lit.md) on renderers that Unity has not baked: built-in and URP.
using UnityEngine;

public class BakedLight : MonoBehaviour
{
    public Texture2D[] pages; // the lightmaps, best EXR; a PNG of MOZ_lightmap is linear: sRGB off
    public Texture2D[] masks; // shadow masks of the same pages, sRGB off, or none
    public Light[] lights;    // whose shadows are in R, G, B and A of the masks

    void Awake()
    {
        var maps = new LightmapData[pages.Length];
        for (var i = 0; i < pages.Length; ++i)
            maps[i] = new LightmapData { lightmapColor = pages[i], shadowMask = i < masks.Length ? masks[i] : null };
        LightmapSettings.lightmapsMode = LightmapsMode.NonDirectional;
        LightmapSettings.lightmaps = maps;
        for (var i = 0; i < lights.Length; ++i)
            lights[i].bakingOutput = new LightBakingOutput
            {
                isBaked = true,
                lightmapBakeType = LightmapBakeType.Mixed,
                mixedLightingMode = MixedLightingMode.Shadowmask,
                occlusionMaskChannel = i
            };
        foreach (var renderer in GetComponentsInChildren<MeshRenderer>())
        {
            renderer.lightmapIndex = 0; // the page that its material names
            renderer.lightmapScaleOffset = new Vector4(1, 1, 0, 0); // UVs are those of the whole page
        }
    }
}
