"""What of models from other public repositories than OpenSim's own can be loaded: those in
`MODELS`, which people in the field use, for shoulders, arms, necks, spines, legs and whole bodies,
exoskeletons and prostheses, predicted gait and machine learning.

    git clone https://github.com/OWNER/NAME FOLDER/OWNER/NAME    # of all that are to be tried
    python -m tests.benchmarks.other_models FOLDER [--timeout SECONDS]

from the repository's root. Every model is loaded in a process of its own. Prints the table of
`docs/opensim_models.md`; where OpenSim's Python package is installed it says of what is refused
whether OpenSim reads it. Asserts nothing.
"""

import argparse
import importlib.util
import multiprocessing
from pathlib import Path

from .public_models import load

# Commit and files of every repository.
MODELS = {
    "AbdnBiomechEng/arm-model": ("9fa4615342513360820a4d53e585fcd8e90fc96d", ["das4_v4.osim"]),
    "antoinefalisse/3dpredictsim": (
        "5fa3929fa9ba29d5c057c16b18671a017d8f15c1",
        [
            "OpenSimModel/subject1/subject1.osim",
            "OpenSimModel/subject1/subject1_v2.osim",
        ],
    ),
    "antoinefalisse/predictsim_mtp": (
        "302f006002b5196fb40b35709b231fc69583a985",
        [
            "OpenSimModel/new_model/Model/generic_model.osim",
            "OpenSimModel/new_model/Model/new_model_scaled_FK_contacts.osim",
            "OpenSimModel/old_model/Model/old_model_scaled_FK_contacts.osim",
            "OpenSimModel/old_model/Model/old_model_noMTP_scaled_FK_contacts.osim",
        ],
    ),
    "CEINMS-RT/LowerLimbModel": (
        "4056e1c6de2276f174c1b1ef3f1de5ea017a0f07",
        ["model/gait2392.osim"],
    ),
    "clnsmith/opensim-jam": (
        "fb777056217ec60e8eb2eedc93fefa5a6e4885e0",
        ["models/lenhart2015/lenhart2015.osim"],
    ),
    "DanielFNG/ergonomics": (
        "8865f8d45b4afb41ce2a1c0138a3791e6df037a9",
        [
            "Examples/SitToStand/2D_gait_jointspace_welded.osim",
            "Scripts/3_MocoSitToStand/2D_gait_contact_constrained_activation.osim",
            "Scripts/19_MoreSubjects/ground_truth/model_configured.osim",
        ],
    ),
    "DanielFNG/musculoskeletal-models": (
        "dac1e7a926612b1fa711e5e5a2679a893e0b9eb6",
        [
            "Francois' Prosthesis/gait23.osim",
            "Francois' Prosthesis/prosthesis.osim",
            "Oxford Lower Limb (Vicon)/gait2354_metabolics.osim",
            "Shank-Foot Spring/df-mi-model.osim",
            "Simple Arm Exoskeleton/arm26_weak_exo.osim",
            "XoR/FullBodyXoR2.osim",
            "XoR/Rajagopal2015v4XoR.osim",
            "XoR/StandXoR.osim",
            "XoR/XoR-gait2392-v4-weld-bushings-fixed-gravity-on.osim",
            "XoR/XoR2-only.osim",
        ],
    ),
    "DanielFNG/opensim-matlab": (
        "bb58d72bc31663ea9caf8acad8475b4ddacf9af8",
        [
            "Defaults/CMC/model.osim",
            "Defaults/Scale/APO_2392_Metabolics_v4.osim",
        ],
    ),
    "jimmyDunne/opensim-matlab": (
        "71bc661dee27a5c62e0cba6962830dcfee21bcc0",
        ["tests/test_data/single_leg.osim"],
    ),
    "keenon/nimblephysics": (
        "c405b056fc35068027e03e0c384e84e12870b475",
        [
            "data/grf/SprinterWithSpine/Models/unscaled_generic.osim",
            "data/osim/CompleteHumanModel/CompleteHumanModel.osim",
            "data/osim/ComplexKnee/gait2392_frontHingeKnee_dem.osim",
            "data/osim/FBLSmodel.osim",
            "data/osim/HamnerSubject04/subject04/unscaled_generic.osim",
            "data/osim/HighBMI/Lernagopal_more_viz.osim",
            "data/osim/LaiArnoldSubject6/LaiArnold2017_refined_arms.osim",
            "data/osim/NoArms_v3/Delp1990.osim",
            "data/osim/Rajagopal2015_v3_scaled/Rajagopal2015_passiveCal_hipAbdMoved.osim",
            "data/osim/ScapulaModel/ScapulothoracicJoint_Shoulder_NoConstraints.osim",
            "data/osim/Sprinter/sprinter.osim",
            "data/regression/Arnold2013Synthetic/subject01/subject01.osim",
        ],
    ),
    "KULeuvenNeuromechanics/PredSim": (
        "a50fb31dba271285c727efa36302f68e60fe34e1",
        [
            "Subjects/DHondt_et_al_2024_3seg/DHondt_et_al_2024_3seg.osim",
            "Subjects/DHondt_et_al_2024_4seg/DHondt_et_al_2024_4seg.osim",
            "Subjects/Falisse_et_al_2022/Falisse_et_al_2022.osim",
            "Subjects/gait1018/gait1018.osim",
        ],
    ),
    "lara-unb/OpenSense": (
        "e0b6dc588f5a9ea1fcd006781ffe3c41ae737982",
        [
            "Models/model_trike_scaled.osim",
            "Models/model_trike_solto.osim",
        ],
    ),
    "laurasaizz/SBI_walking": ("a1ad7e5240558df9fabea09eb7737ece0a7edf61", ["Rajagopal2016.osim"]),
    "mariasoroka/Musculoskeletal_model_of_neck_and_shoulder": (
        "4e2f893280998186648f500f8f1798ce03694f25",
        [
            "Models/ModelOfNeckAndShoulder.osim",
        ],
    ),
    "mitkof6/musculoskeletal-stiffness": (
        "150a43a3d748bb0b630e77cde19ab65df5fb089c",
        [
            "dataset/Gait10dof18musc/gait10dof18musc.osim",
        ],
    ),
    "mitkof6/OpenSimRT": (
        "32512978713ef0090c0b4f0e45aa4b315cf5be46",
        [
            "data/gait1992/model/model_generic.osim",
            "data/gait1992/residual_reduction_algorithm/model_adjusted.osim",
            "data/mobl2016/mobl2016_v04.osim",
        ],
    ),
    "mjhmilla/kinematicPassengerModel": (
        "5096f5537c26d1100a46b8d4362ad5a109c054e9",
        [
            "models/Christophy2012_axialRotationUpd_skeletonOnly.osim",
            "models/Mortensen2014_rigidTorso.osim",
            "models/passengerModel.osim",
        ],
    ),
    "modenaxe/3d-muscles": (
        "e30f2ff0feeec7b970392d0a29784d43b5dbfb0c",
        ["a_MSK_model/a_MSK_model/LHDL_hip_r.osim"],
    ),
    "modenaxe/msk-STAPLE": (
        "eec7db1c1a54363b23b344956f972d8c4ede198f",
        [
            "tests/ref_models/bilateral/TLEM2_MRI_bilateral.osim",
            "tests/ref_models/paper/automatic_ICL_MRI.osim",
            "tests/ref_models/paper/automatic_JIA_MRI.osim",
            "tests/ref_models/paper/automatic_LHDL_CT.osim",
        ],
    ),
    "MyoHub/myoconverter": (
        "cadf38059367a51239e6dc28c9fbe8b8fbd5149f",
        [
            "models/osim/Arm26/arm26.osim",
            "models/osim/Gait10dof18musc/gait10dof18musc.osim",
            "models/osim/Gait2354Simbody/gait2354.osim",
            "models/osim/Leg6Dof9Musc/leg6dof9musc.osim",
            "models/osim/Neck6D/HYOID_1.2_ScaledStrenght_UpdatedInertia.osim",
            "models/osim/Neck6D/neck6d.osim",
        ],
    ),
    "opensim-org/SCONE": (
        "6c8e8e3e45615ae2065a27243cfd8fbb778195a2",
        [
            "resources/models/H0918M_osim3.osim",
            "scenarios/Examples/data/H0914M_osim4.osim",
            "scenarios/Examples/data/H0918M_osim4.osim",
            "scenarios/Tutorials/data/Human0914.osim",
            "scenarios/Tutorials/data/Human0916.osim",
            "scenarios/UnitTests/OpenSim3/data/f1534m.osim",
        ],
    ),
    "panyland/opensim-full-body": ("fa2a5f9e3b45d69c6b1ab4ed48cb6fc033a65beb", ["model.osim"]),
    "PARCO-LAB/opensim-batch-dynamics": (
        "406535ea9ce07c6637703d5797d6d1c34b07db98",
        [
            "model/LaiUhlrich2022_torque_only.osim",
            "model/bsm/bsm.osim",
        ],
    ),
    "perfanalytics/pose2sim": (
        "f7b39c747b361ce2cef2304bd7d42dddd15b3d36",
        [
            "Pose2Sim/OpenSim_Setup/Model_Pose2Sim_muscles_flex.osim",
            "Pose2Sim/OpenSim_Setup/Model_Pose2Sim_simple.osim",
        ],
    ),
    "pyomeca/biobuddy": (
        "3f598b39a15d9a9f49b8f17196f80eb942dbe90a",
        [
            "examples/models/MOBL_ARMS_41.osim",
            "examples/models/wholebody.osim",
            "examples/models/Wu_Shoulder_Model_via_points.osim",
        ],
    ),
    "rcnl-org/nmsm-core": ("67cb12587d8e49ec3457f8a7145c45e875baf507", ["RCNL2024.osim"]),
    "RealTimeBiomechanics/rtosim": (
        "e8831e4e4b0ce2d82ffcb35b58387a1d4693c36f",
        ["data/InverseKinematics/subject01_simbody.osim"],
    ),
    "ross-wilkinson/opensim-model-fullBodyMuscleActuated": (
        "3cfbe329a8ef9412494980419cb7177c41183a53",
        [
            "cyclistFullBodyMuscle.osim",
        ],
    ),
    "ross-wilkinson/opensimModelling": ("dc428169caf94aa41167dbb7a387652ebdb2b500", ["model.osim"]),
    "stanfordnmbl/coupled-exo-sim": (
        "de55d59962450f0d8a64005db42cb72c01ffe849",
        [
            "Rajagopal2015_18musc_muscle_names_probed_iliacus.osim",
            "Rajagopal2015_muscle_names_probed.osim",
        ],
    ),
    "stanfordnmbl/mocopaper": (
        "8ac8bba0e0f08dc62d0d3b727d7987c521c95fbc",
        [
            "resources/ArnoldSubject02Walk3/subject02_armless.osim",
            "resources/Falisse2019/2D_gait.osim",
            "resources/Rajagopal2016/subject_walk_armless_18musc.osim",
            "resources/Rajagopal2016/subject_walk_contact_bounded_80musc.osim",
            "resources/squat_to_stand_4dof9musc.osim",
        ],
    ),
    "stanfordnmbl/opencap-core": (
        "d5a52589542e3329691bc26efef0a15b7d5cf38d",
        [
            "opensimPipeline/Models/LaiUhlrich2022.osim",
            "opensimPipeline/Models/LaiUhlrich2022_shoulder.osim",
        ],
    ),
    "stanfordnmbl/opencap-processing": (
        "dd0b30c2ee8937938c3a40fe75f661641e61fc61",
        [
            "Moco/models/LaiArnoldModified2017_contacts.osim",
        ],
    ),
    "stanfordnmbl/osim-rl": (
        "610b95cf0c4484f1acecd31187736b0113dcfb73",
        [
            "osim/models/arm26.osim",
            "osim/models/gait14dof22musc_planar_20170320.osim",
            "osim/models/gait14dof22musc_pros_20180507.osim",
            "osim/models/gait9dof18musc.osim",
            "osim/models/hop8dof9musc.osim",
            "osim/models/MoBL_ARMS_J_Simple_032118.osim",
            "osim/models/MoBL_ARMS_J.osim",
        ],
    ),
    "wwrzesien/squat-analysis": (
        "555e83430c96b168744883892a18b3b1dc8305cc",
        ["Rajagopal2015.osim"],
    ),
    "zoufaond/Exoskelet_matlab": (
        "eb5f8277b45a1427dae05a99192447c58ab0bded",
        [
            "Shoulder_Chadwick/das3.osim",
            "Shoulder_Chadwick/DAS3-simplified/model/das3_mod_full.osim",
            "Shoulder_Chadwick/DAS3-simplified/model/das3_mod_simplified.osim",
        ],
    ),
    "zwq817/jump-simulation": ("a2d4aa6bdb13819ddc6d20da168ef62d6b8aee1b", ["Scaled_Model.osim"]),
}


def in_a_process(function, file, seconds):
    """What a function makes of a file, or a text why not."""
    context = multiprocessing.get_context("fork")
    answers = context.SimpleQueue()
    process = context.Process(target=lambda: answers.put(function(file)))
    process.start()
    process.join(seconds)
    if process.is_alive():
        process.kill()
        process.join()
        return f"not within {seconds:g} s"
    return f"died with {process.exitcode}" if answers.empty() else answers.get()


def loaded(file):
    """Size, and why it is refused."""
    found = load("model", file)
    return found.size, found.refused


def read_by_opensim(file):
    import opensim

    opensim.Logger.setLevelString("Off")
    try:
        opensim.Model(str(file)).initSystem()
    except RuntimeError:
        return "OpenSim does not read it either"
    return ""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", metavar="FOLDER", type=Path)
    parser.add_argument("--timeout", metavar="SECONDS", type=float, default=120.0)
    arguments = parser.parse_args()
    has_opensim = importlib.util.find_spec("opensim") is not None
    load("model", Path("none.osim"))  # what is imported on the way, once for all processes
    tried, good = 0, 0
    print("| repository, commit | model | loads |", "|---|---|---|", sep="\n")
    for repository, (commit, names) in MODELS.items():
        link = f"[{repository}](https://github.com/{repository}) `{commit[:10]}`"
        for name in names:
            file = arguments.folder / repository / name
            if not file.is_file():
                parser.error(f"no file {file}")
            answer = in_a_process(loaded, file, arguments.timeout)
            size, why = ("", answer) if isinstance(answer, str) else answer
            if why and has_opensim:
                said = in_a_process(read_by_opensim, file, arguments.timeout)
                why = f"{why}; {said}" if said else why
            tried, good = tried + 1, good + (not why)
            print(f"| {link} | `{name}` | {size or f'no: {why}'} |", flush=True)
            link = ""
    print(f"\n{good} of {tried} load")


if __name__ == "__main__":
    main()
