// How each part of the head takes the light. Colours come from the face file, the surface from here.
import { Color, DoubleSide, MeshPhysicalMaterial, ShaderChunk } from 'three';

const SURFACES = {
  skin: { roughness: 0.5, specularIntensity: 0.45, sheen: 0.35, sheenRoughness: 0.45, sheenColor: new Color(0.95, 0.62, 0.5) },
  lips: { roughness: 0.34, specularIntensity: 0.6, clearcoat: 0.16, clearcoatRoughness: 0.35 },
  teeth: { roughness: 0.22, specularIntensity: 0.7, clearcoat: 0.5, clearcoatRoughness: 0.15 },
  tongue: { roughness: 0.38, clearcoat: 0.35, clearcoatRoughness: 0.3 },
  mouth: { roughness: 0.6, clearcoat: 0.15, clearcoatRoughness: 0.4 },
  eye: { roughness: 0.18, clearcoat: 1, clearcoatRoughness: 0.04 },
  hair: { roughness: 0.7 },
};

/** Light reaches round the edge of flesh, the red of it furthest. */
const WRAP = { skin: [0.34, 0.16, 0.12], lips: [0.34, 0.14, 0.12], tongue: [0.3, 0.1, 0.1] };

function letLightWrap(material, [red, green, blue]) {
  const hard = 'vec3 irradiance = dotNL * directLight.color;';
  const soft = `
    const vec3 wrap = vec3(${red.toFixed(2)}, ${green.toFixed(2)}, ${blue.toFixed(2)});
    vec3 wrapped = saturate((dot(geometryNormal, directLight.direction) + wrap) / ((1.0 + wrap) * (1.0 + wrap)));
    vec3 irradiance = dotNL * directLight.color;
    vec3 softIrradiance = wrapped * directLight.color;`;
  const diffuse = 'reflectedLight.directDiffuse += irradiance * BRDF_Lambert';
  const chunk = ShaderChunk.lights_physical_pars_fragment;
  if (!chunk.includes(hard) || !chunk.includes(diffuse)) return;
  const replaced = chunk
    .replace(hard, soft)
    .replace(diffuse, 'reflectedLight.directDiffuse += softIrradiance * BRDF_Lambert');
  material.onBeforeCompile = (shader) => {
    shader.fragmentShader = shader.fragmentShader.replace('#include <lights_physical_pars_fragment>', replaced);
  };
  material.customProgramCacheKey = () => `wrap ${red} ${green} ${blue}`;
}

/** The material to show a part of `kind` with, after the one in the face file. */
export function materialFor(kind, source) {
  // One with pictures of its own looks as its maker meant it to.
  if (source.map || source.normalMap || source.emissiveMap || source.isMeshBasicMaterial) return source;
  const material = new MeshPhysicalMaterial({
    name: source.name,
    color: source.color,
    roughness: source.roughness,
    metalness: 0,
    opacity: source.opacity,
    transparent: source.transparent,
    vertexColors: source.vertexColors,
    side: source.side ?? DoubleSide,
    ...SURFACES[kind],
  });
  if (WRAP[kind]) letLightWrap(material, WRAP[kind]);
  return material;
}
