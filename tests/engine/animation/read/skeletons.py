"""Joint names of common rigs as trees: name -> parent's name."""

SIDES = (("Left", "left", "l", "L"), ("Right", "right", "r", "R"))


def _both(*rows: str) -> dict[str, str]:
    """Rows `name parent` for both sides; {S}, {s}, {l}, {L} stand for Left, left, l and L."""
    out = {}
    for words in SIDES:
        for row in rows:
            name, parent = row.split(">")
            parts = dict(zip(("S", "s", "l", "L"), words, strict=True))
            out[name.format(**parts)] = parent.format(**parts)
    return out


RIGS: dict[str, dict[str, str | None]] = {
    "unreal": {
        "root": None, "pelvis": "root", "spine_01": "pelvis", "spine_02": "spine_01", "spine_03": "spine_02",
        "spine_04": "spine_03", "spine_05": "spine_04", "neck_01": "spine_05", "neck_02": "neck_01",
        "head": "neck_02",
        **_both("clavicle_{l}>spine_05", "upperarm_{l}>clavicle_{l}", "lowerarm_{l}>upperarm_{l}",
                "lowerarm_twist_01_{l}>lowerarm_{l}", "hand_{l}>lowerarm_{l}", "index_metacarpal_{l}>hand_{l}",
                "index_01_{l}>index_metacarpal_{l}", "index_02_{l}>index_01_{l}", "index_03_{l}>index_02_{l}",
                "thumb_01_{l}>hand_{l}", "thigh_{l}>pelvis", "thigh_twist_01_{l}>thigh_{l}", "calf_{l}>thigh_{l}",
                "foot_{l}>calf_{l}", "ball_{l}>foot_{l}", "ik_foot_{l}>root", "ik_hand_{l}>root"),
    },
    "vrm": {
        "hips": None, "spine": "hips", "chest": "spine", "upperChest": "chest", "neck": "upperChest", "head": "neck",
        **_both("{s}Shoulder>upperChest", "{s}UpperArm>{s}Shoulder", "{s}LowerArm>{s}UpperArm", "{s}Hand>{s}LowerArm",
                "{s}ThumbMetacarpal>{s}Hand", "{s}ThumbProximal>{s}ThumbMetacarpal", "{s}IndexProximal>{s}Hand",
                "{s}LittleProximal>{s}Hand", "{s}LittleIntermediate>{s}LittleProximal", "{s}UpperLeg>hips",
                "{s}LowerLeg>{s}UpperLeg", "{s}Foot>{s}LowerLeg", "{s}Toes>{s}Foot"),
    },
    "vroid": {
        "J_Bip_C_Hips": None, "J_Bip_C_Spine": "J_Bip_C_Hips", "J_Bip_C_Chest": "J_Bip_C_Spine",
        "J_Bip_C_Neck": "J_Bip_C_Chest", "J_Bip_C_Head": "J_Bip_C_Neck",
        **_both("J_Bip_{L}_UpperArm>J_Bip_C_Chest", "J_Bip_{L}_LowerArm>J_Bip_{L}_UpperArm",
                "J_Bip_{L}_Hand>J_Bip_{L}_LowerArm", "J_Bip_{L}_UpperLeg>J_Bip_C_Hips",
                "J_Bip_{L}_LowerLeg>J_Bip_{L}_UpperLeg", "J_Bip_{L}_Foot>J_Bip_{L}_LowerLeg"),
    },
    "kinect": {
        "SpineBase": None, "SpineMid": "SpineBase", "SpineShoulder": "SpineMid", "Neck": "SpineShoulder",
        "Head": "Neck",
        **_both("Shoulder{S}>SpineShoulder", "Elbow{S}>Shoulder{S}", "Wrist{S}>Elbow{S}", "Hand{S}>Wrist{S}",
                "Hip{S}>SpineBase", "Knee{S}>Hip{S}", "Ankle{S}>Knee{S}", "Foot{S}>Ankle{S}"),
    },
    "xsens": {
        "Pelvis": None, "L5": "Pelvis", "L3": "L5", "T12": "L3", "T8": "T12", "Neck": "T8", "Head": "Neck",
        **_both("{S}Shoulder>T8", "{S}UpperArm>{S}Shoulder", "{S}Forearm>{S}UpperArm", "{S}Hand>{S}Forearm",
                "{S}UpperLeg>Pelvis", "{S}LowerLeg>{S}UpperLeg", "{S}Foot>{S}LowerLeg", "{S}Toe>{S}Foot"),
    },
    "rokoko": {
        "Hips": None, "Spine1": "Hips", "Spine2": "Spine1", "Spine3": "Spine2", "Spine4": "Spine3", "Neck": "Spine4",
        "Head": "Neck",
        **_both("{S}Shoulder>Spine4", "{S}Arm>{S}Shoulder", "{S}ForeArm>{S}Arm", "{S}Hand>{S}ForeArm",
                "{S}Finger1Proximal>{S}Hand", "{S}Finger2Metacarpal>{S}Hand",
                "{S}Finger2Proximal>{S}Finger2Metacarpal", "{S}Finger2Medial>{S}Finger2Proximal",
                "{S}Finger2Distal>{S}Finger2Medial", "{S}Thigh>Hips", "{S}Shin>{S}Thigh", "{S}Foot>{S}Shin"),
    },
    "biped": {
        "Bip01": None, "Bip01 Pelvis": "Bip01", "Bip01 Spine": "Bip01 Pelvis", "Bip01 Spine1": "Bip01 Spine",
        "Bip01 Neck": "Bip01 Spine1", "Bip01 Head": "Bip01 Neck",
        **_both("Bip01 {L} Clavicle>Bip01 Neck", "Bip01 {L} UpperArm>Bip01 {L} Clavicle",
                "Bip01 {L} Forearm>Bip01 {L} UpperArm", "Bip01 {L} Hand>Bip01 {L} Forearm",
                "Bip01 {L} Finger0>Bip01 {L} Hand", "Bip01 {L} Finger1>Bip01 {L} Hand",
                "Bip01 {L} Finger11>Bip01 {L} Finger1", "Bip01 {L} Thigh>Bip01 Pelvis",
                "Bip01 {L} Calf>Bip01 {L} Thigh", "Bip01 {L} Foot>Bip01 {L} Calf", "Bip01 {L} Toe0>Bip01 {L} Foot"),
    },
    "daz": {
        "hip": None, "abdomenLower": "hip", "chestUpper": "abdomenLower", "neckLower": "chestUpper",
        "head": "neckLower",
        **_both("{l}Collar>chestUpper", "{l}ShldrBend>{l}Collar", "{l}ForearmBend>{l}ShldrBend",
                "{l}Hand>{l}ForearmBend", "{l}ThighBend>hip", "{l}Shin>{l}ThighBend", "{l}Foot>{l}Shin"),
    },
    "asf": {
        "root": None, "lowerback": "root", "upperback": "lowerback", "thorax": "upperback", "lowerneck": "thorax",
        "head": "lowerneck",
        **_both("{l}hipjoint>root", "{l}femur>{l}hipjoint", "{l}tibia>{l}femur", "{l}foot>{l}tibia",
                "{l}toes>{l}foot", "{l}clavicle>thorax", "{l}humerus>{l}clavicle", "{l}radius>{l}humerus",
                "{l}wrist>{l}radius", "{l}hand>{l}wrist"),
    },
}  # fmt: skip

EXPECTED: dict[str, str] = {
    "unreal": "pelvis=Hips spine_01=Spine spine_03=Spine1 spine_05=Spine2 neck_01=Neck neck_02= head=Head root= "
    "clavicle_l=LeftShoulder upperarm_r=RightArm lowerarm_l=LeftForeArm lowerarm_twist_01_l= hand_l=LeftHand "
    "index_metacarpal_l= index_01_l=LeftHandIndex1 index_03_r=RightHandIndex3 thumb_01_l=LeftHandThumb1 "
    "thigh_l=LeftUpLeg thigh_twist_01_l= calf_r=RightLeg foot_l=LeftFoot ball_l=LeftToeBase ik_foot_l= ik_hand_r=",
    "vrm": "hips=Hips spine=Spine chest=Spine1 upperChest=Spine2 leftShoulder=LeftShoulder leftUpperArm=LeftArm "
    "rightLowerArm=RightForeArm leftThumbMetacarpal=LeftHandThumb1 leftLittleProximal=LeftHandPinky1 "
    "leftLittleIntermediate=LeftHandPinky2 rightUpperLeg=RightUpLeg leftLowerLeg=LeftLeg leftToes=LeftToeBase",
    "vroid": "J_Bip_C_Hips=Hips J_Bip_C_Spine=Spine J_Bip_C_Chest=Spine2 J_Bip_L_UpperArm=LeftArm "
    "J_Bip_R_Hand=RightHand J_Bip_L_LowerLeg=LeftLeg",
    "kinect": "SpineBase=Hips SpineMid=Spine SpineShoulder=Spine2 ShoulderLeft=LeftArm ElbowRight=RightForeArm "
    "WristLeft=LeftHand HandLeft=LeftHandMiddle1 HipLeft=LeftUpLeg AnkleLeft=LeftFoot FootRight=RightToeBase",
    "xsens": "Pelvis=Hips L5=Spine L3= T12=Spine1 T8=Spine2 LeftShoulder=LeftShoulder LeftUpperArm=LeftArm "
    "RightForearm=RightForeArm LeftUpperLeg=LeftUpLeg LeftLowerLeg=LeftLeg RightToe=RightToeBase",
    "rokoko": "Spine1=Spine Spine2= Spine3=Spine1 Spine4=Spine2 LeftFinger1Proximal=LeftHandThumb1 "
    "LeftFinger2Metacarpal= RightFinger2Medial=RightHandIndex2 LeftThigh=LeftUpLeg LeftShin=LeftLeg",
    "biped": "Bip01= Bip01_Pelvis=Hips Bip01_L_Clavicle=LeftShoulder Bip01_R_UpperArm=RightArm "
    "Bip01_L_Finger0=LeftHandThumb1 Bip01_L_Finger11=LeftHandIndex2 Bip01_L_Toe0=LeftToeBase",
    "daz": "hip=Hips neckLower=Neck lCollar=LeftShoulder lShldrBend=LeftArm rForearmBend=RightForeArm "
    "rThighBend=RightUpLeg lShin=LeftLeg",
    "asf": "root=Hips lowerneck=Neck lhipjoint= lfemur=LeftUpLeg rtibia=RightLeg lclavicle=LeftShoulder "
    "lhumerus=LeftArm lwrist=LeftHand lhand=LeftHandMiddle1 rtoes=RightToeBase",
}
"""Rig -> `joint=role` of the joints that identify the rig, blanks in names as underscores."""
