"""Lines of Mouthpiece as Animation Sequences of a MetaHuman's face, for Unreal 5's own Python (docs/guides/into_unreal.md)."""
import json
import os

import unreal

SKELETON = "/Game/MetaHumans/Common/Face/Face_Archetype_Skeleton"


def load(file, asset, skeleton=SKELETON):
    """Makes the Animation Sequence `asset` ("/Game/Voice/line") of a line's .metahuman.json; one that is there gets its curves."""
    with open(file, encoding="utf-8") as text:
        line = json.load(text)
    rate, frames = line["fps"], line["frames"]
    bones = unreal.load_asset(skeleton)
    if not bones:
        raise RuntimeError("no skeleton at " + skeleton + ": name that of your MetaHuman's face")
    folder, name = asset.rsplit("/", 1)
    if unreal.EditorAssetLibrary.does_asset_exist(asset):
        sequence = unreal.load_asset(asset)
    else:
        factory = unreal.AnimSequenceFactory()
        factory.set_editor_property("target_skeleton", bones)
        sequence = unreal.AssetToolsHelpers.get_asset_tools().create_asset(name, folder, unreal.AnimSequence, factory)
    controller = sequence.get_editor_property("controller")
    controller.open_bracket("Mouthpiece")
    controller.set_frame_rate(unreal.FrameRate(round(1000 * rate), 1000))
    controller.set_number_of_frames(unreal.FrameNumber(max(1, len(frames) - 1)))
    controller.close_bracket()
    times = [frame / rate for frame in range(len(frames))]
    library, kind = unreal.AnimationLibrary, unreal.RawCurveTrackTypes.RCT_FLOAT
    for column, curve in enumerate(line["names"]):
        if library.does_curve_exist(sequence, curve, kind):
            library.remove_curve(sequence, curve)
        library.add_curve(sequence, curve, kind)
        library.add_float_curve_keys(sequence, curve, times, [frame[column] for frame in frames])
    unreal.EditorAssetLibrary.save_loaded_asset(sequence)
    return sequence


def load_folder(folder, into, skeleton=SKELETON):
    """The same for every .metahuman.json of a folder and those below it; assets in `into` ("/Game/Voice") by the files' names."""
    for where, _, names in sorted(os.walk(folder)):
        for name in sorted(names):
            if name.endswith(".metahuman.json"):
                below = os.path.relpath(where, folder).replace(os.sep, "/")
                load(os.path.join(where, name), "/".join([into] + ([] if below == "." else [below]) + [name[: -len(".metahuman.json")]]), skeleton)
