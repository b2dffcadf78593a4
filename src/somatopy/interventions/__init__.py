"""Interventions: damages and other changes that are made to an experiment for the length of a phase."""

from somatopy.contract import Intervention, Stage
from somatopy.interventions.babble import OtherBabbling
from somatopy.interventions.base import NoIntervention
from somatopy.interventions.beyond_arm import HeadShift, MirroredPicture
from somatopy.interventions.body import AlteredBody, LongerArm, MovedMarker, TurnedCamera
from somatopy.interventions.check import check_intervention
from somatopy.interventions.drift import JointDrift
from somatopy.interventions.felt import DeadJoint, EncoderNoise, JointGain, JointOrder
from somatopy.interventions.learning import Afresh, PlasticParts, Shuffled
from somatopy.interventions.offset import PAPER_OFFSET, JointOffset
from somatopy.interventions.suite import JOINTS, SUITE
from somatopy.registry import INTERVENTIONS

INTERVENTIONS.add("offset", "somatopy.interventions.offset:Offset")
INTERVENTIONS.add("random-offset", "somatopy.interventions.offset:RandomOffset")
INTERVENTIONS.add("gain", "somatopy.interventions.felt:Gain")
INTERVENTIONS.add("swapped", "somatopy.interventions.felt:Swapped")
INTERVENTIONS.add("permuted", "somatopy.interventions.felt:Permuted")
INTERVENTIONS.add("dead-joint", "somatopy.interventions.felt:Dead")
INTERVENTIONS.add("noise", "somatopy.interventions.felt:Noise")
INTERVENTIONS.add("drift", "somatopy.interventions.drift:Drift")
INTERVENTIONS.add("head-offset", "somatopy.interventions.beyond_arm:HeadOffset")
INTERVENTIONS.add("mirrored", "somatopy.interventions.beyond_arm:Mirrored")
INTERVENTIONS.add("camera", "somatopy.interventions.body:CameraTurn")
INTERVENTIONS.add("marker", "somatopy.interventions.body:MarkerMoved")
INTERVENTIONS.add("longer-arm", "somatopy.interventions.body:Longer")
INTERVENTIONS.add("arm-speed", "somatopy.interventions.babble:ArmSpeed")
INTERVENTIONS.add("babbling-range", "somatopy.interventions.babble:BabblingRange")
INTERVENTIONS.add("plastic", "somatopy.interventions.learning:PlasticParts")
INTERVENTIONS.add("afresh", "somatopy.interventions.learning:Afresh")
INTERVENTIONS.add("shuffled", "somatopy.interventions.learning:Shuffled")

__all__ = [
    "JOINTS",
    "PAPER_OFFSET",
    "SUITE",
    "Afresh",
    "AlteredBody",
    "DeadJoint",
    "EncoderNoise",
    "HeadShift",
    "Intervention",
    "JointDrift",
    "JointGain",
    "JointOffset",
    "JointOrder",
    "LongerArm",
    "MirroredPicture",
    "MovedMarker",
    "NoIntervention",
    "OtherBabbling",
    "PlasticParts",
    "Shuffled",
    "Stage",
    "TurnedCamera",
    "check_intervention",
]
