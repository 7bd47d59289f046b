"""URDFs that go wrong in every way we know of, made here so that nothing large is stored.

`REFUSED` must each raise one UrdfError that holds the fragments listed; `ACCEPTED` must each give a
correct robot, with those warnings; `FAULTY` a correct robot in which one joint carries a fault.
"""

from __future__ import annotations

from itertools import pairwise

LIMIT = '<limit lower="-1" upper="1.5" effort="1" velocity="1"/>'
AXIS = '<axis xyz="0 0 1"/>'
ORIGIN = '<origin xyz="0.1 0.2 0.3" rpy="0.4 -0.5 0.6"/>'


def link(name: str, inner: str = "") -> str:
    return f'<link name="{name}">{inner}</link>'


def joint(
    inner: str = ORIGIN + AXIS + LIMIT,
    name: str = "elbow",
    kind: str = "revolute",
    parent: str = "base",
    child: str = "arm",
) -> str:
    return (
        f'<joint name="{name}" type="{kind}">'
        f'<parent link="{parent}"/><child link="{child}"/>{inner}</joint>'
    )


def urdf(*parts: str, head: str = "") -> str:
    return f'{head}<robot name="test">\n' + "\n".join(parts) + "\n</robot>\n"


def arm(inner: str = ORIGIN + AXIS + LIMIT, kind: str = "revolute", **more: str) -> str:
    """Base, one joint called elbow, arm; then a wrist that turns."""
    return urdf(
        link("base"),
        link("arm"),
        link("hand"),
        joint(inner, kind=kind, **more),
        joint(name="wrist", parent="arm", child="hand"),
    )


def chain(count: int, kind: str = "fixed") -> str:
    links = [link(f"l{i}") for i in range(count)]
    joints = [joint(LIMIT, f"j{i}", kind, f"l{i - 1}", f"l{i}") for i in range(1, count)]
    return urdf(*links, *joints)


def star(count: int, kind: str = "fixed") -> str:
    links = [link(f"l{i}") for i in range(count)]
    return urdf(*links, *(joint(LIMIT, f"j{i}", kind, "l0", f"l{i}") for i in range(1, count)))


def drawn(visual: str) -> str:
    return urdf(link("base", f"<visual>{visual}</visual>"), link("arm"), joint())


def mesh(name: str, more: str = "") -> str:
    return drawn(f'<geometry><mesh filename="{name}"{more}/></geometry>')


def origin(xyz: str = "0 0 0", rpy: str = "0 0 0") -> str:
    return arm(f'<origin xyz="{xyz}" rpy="{rpy}"/>' + LIMIT)


def limit(attributes: str, kind: str = "revolute", more: str = "") -> str:
    return arm(f"<limit {attributes}/>{more}", kind=kind)


BOMB = (
    '<!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa">'
    + "".join(f'<!ENTITY {new} "{f"&{old};" * 10}">' for old, new in pairwise("abcdefghi"))
    + ']>\n<robot name="&i;"><link name="base"/></robot>'
)
XXE = (
    '<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="&x;">'
    '<link name="base"/></robot>'
)
REMOTE = '<!DOCTYPE robot SYSTEM "http://127.0.0.1:9/robot.dtd"><robot name="r"/>'
XACRO_HEAD = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'

REFUSED: dict[str, tuple[str | bytes, tuple[str, ...]]] = {
    # numbers
    "origin with commas": (origin("1,0,0"), ("elbow", "'1,0,0'", "separated by spaces")),
    "origin of two numbers": (origin("1 0"), ("elbow", "'1 0'", "3 finite numbers")),
    "origin of four numbers": (origin("1 2 3 4"), ("elbow", "3 finite numbers")),
    "origin empty": (origin(""), ("elbow", "3 finite numbers")),
    "origin in words": (origin("a b c"), ("elbow", "3 finite numbers")),
    "origin in hex": (origin("0x10 0 0"), ("elbow", "3 finite numbers")),
    "origin with decimal commas": (origin("0,5 0 0"), ("elbow", "3 finite numbers")),
    "origin with underscores": (origin("1_0 0 0"), ("elbow", "3 finite numbers")),
    "origin in other digits": (origin("١ 0 0"), ("elbow", "3 finite numbers")),
    "origin NaN": (origin("nan 0 0"), ("elbow", "3 finite numbers")),
    "origin inf": (origin("0 inf 0"), ("elbow", "3 finite numbers")),
    "origin 1e308": (origin("0 0 1e308"), ("elbow", "finite numbers of at most 10000")),
    "origin 1e400": (origin("0 0 -1e400"), ("elbow", "finite numbers")),
    "rpy NaN": (origin(rpy="0 NaN 0"), ("elbow", "rpy", "3 finite numbers")),
    "rpy huge": (origin(rpy="1e16 0 0"), ("elbow", "rpy", "finite numbers")),
    "rpy with units": (origin(rpy="90deg 0 0"), ("elbow", "rpy", "3 finite numbers")),
    "long attribute": (origin("0 " * 500_000), ("elbow", "3 finite numbers", "...")),
    "origin as quaternion": (
        arm('<origin xyz="0 0 0" quat_xyzw="0 0 1 0"/>' + LIMIT),
        ("elbow", "quat_xyzw", "write xyz and rpy"),
    ),
    "origin attribute in capitals": (
        arm('<origin XYZ="0 0 1"/>' + LIMIT),
        ("elbow", "'XYZ'", "write xyz and rpy"),
    ),
    "origin misspelt": (arm('<orgin xyz="0 0 1"/>' + LIMIT), ("elbow", "orgin", "write <origin>")),
    # axes
    "axis zero": (arm('<axis xyz="0 0 0"/>' + LIMIT), ("elbow", "no direction", "not zero")),
    "axis tiny": (arm('<axis xyz="0 1e-9 0"/>' + LIMIT), ("elbow", "no direction")),
    "axis NaN": (arm('<axis xyz="nan 0 1"/>' + LIMIT), ("elbow", "3 finite numbers")),
    "axis infinite": (arm('<axis xyz="0 0 1e999"/>' + LIMIT), ("elbow", "finite numbers")),
    "axis without xyz": (arm("<axis/>" + LIMIT), ("elbow", "no xyz", '<axis xyz="0 0 1"/>')),
    "two axes": (arm(AXIS + '<axis xyz="1 0 0"/>' + LIMIT), ("elbow", "2 <axis>", "keep one")),
    "two origins": (arm(ORIGIN + ORIGIN + LIMIT), ("elbow", "2 <origin>", "keep one")),
    "two limits": (arm(LIMIT + LIMIT), ("elbow", "2 <limit>", "keep one")),
    # kinds
    "floating": (arm(kind="floating"), ("elbow", "floating", "make it fixed")),
    "planar": (arm(kind="planar"), ("elbow", "planar", "prismatic and revolute")),
    "kind unknown": (arm(kind="hinge"), ("elbow", "'hinge'", "revolute, continuous, prismatic")),
    "kind in capitals": (arm(kind="Revolute"), ("elbow", "did you mean 'revolute'?")),
    "kind missing": (arm().replace('type="revolute"', "", 1), ("elbow", "no type")),
    # names and the tree
    "joint without a name": (arm(name=""), ("<joint> has no name", 'name="..."')),
    "link without a name": (urdf("<link/>"), ("<link> has no name",)),
    "name of spaces": (urdf(link("   ")), ("has no name",)),
    "name with a line break": (urdf(link("a&#10;b")), ("'a\\nb'", "printable")),
    "name that turns text around": (urdf(link("a\u202eb")), ("printable",)),
    "name too long": (urdf(link("x" * 100_000)), ("1 to 200", "...")),
    "joint called universe": (arm(name="universe"), ("'universe'", "rename")),
    "link called universe": (arm(child="universe").replace('"arm"', '"universe"'), ("rename",)),
    "two links of one name": (
        urdf(link("base"), link("base")),
        ("line 3", "'base'", "line 2", "rename"),
    ),
    "two joints of one name": (
        urdf(link("base"), link("arm"), link("hand"), joint(), joint(child="hand")),
        ("line 6", "'elbow'", "line 5", "rename"),
    ),
    "parent unknown": (arm(parent="bass"), ("elbow", "parent", "'bass'", "correct the name")),
    "child unknown": (arm(child="harm"), ("elbow", "child", "'harm'", "correct the name")),
    "parent missing": (arm().replace('<parent link="base"/>', ""), ("elbow", "has no parent")),
    "child missing": (arm().replace('<child link="arm"/>', ""), ("elbow", "has no child")),
    "parent without link": (
        arm().replace('<parent link="base"/>', "<parent/>"),
        ("elbow", "<parent> has no link"),
    ),
    "two parents in a joint": (
        arm('<parent link="hand"/>' + LIMIT),
        ("elbow", "2 <parent>", "keep one"),
    ),
    "link with two parents": (
        arm().replace("</robot>", joint(name="bar", child="hand") + "</robot>"),
        ("'hand'", "'wrist'", "'bar'", "loop", "removing one"),
    ),
    "cycle beside the base": (
        urdf(
            link("base"), link("arm"), link("a"), link("b"), joint(),
            joint(name="j1", parent="a", child="b"), joint(name="j2", parent="b", child="a"),
        ),
        ("'a', 'b'", "loop", "remove"),
    ),
    "cycle without a base": (
        urdf(link("base"), link("arm"), joint(), joint(name="j", parent="arm", child="base")),
        ("loop", "no base"),
    ),
    "joint from a link to itself": (
        urdf(link("base"), link("arm"), joint(), joint(name="j", parent="arm", child="arm")),
        ("'arm'", "'elbow'", "'j'", "loop"),
    ),
    "two roots": (urdf(link("base"), link("arm")), ("'base'", "'arm'", "join")),
    "no links": (urdf(), ("no links",)),
    "joints without links": (urdf(joint()), ("no links",)),
    "Link in capitals": (urdf('<Link name="base"/>', link("arm")), ("<Link>", "write <link>")),
    # size
    "chain of 5,000": (chain(5000), ("5,000 links", "1,000")),
    "star of 5,000": (star(5000), ("5,000 links", "1,000")),
    "4,000 joints on two links": (
        urdf(link("base"), link("arm"), *(joint(name=f"j{i}") for i in range(4000))),
        ("4,000 joints",),
    ),
    "chain of 300": (chain(300), ("299 joints in a row", "200")),
    "star of 300 moving": (star(300, "revolute"), ("299 moving joints", "150")),
    "deep nesting": (urdf("<a>" * 100_000 + "</a>" * 100_000), ("nested", "64")),
    "many elements": (urdf("<a/>" * 200_000), ("50,000 XML elements",)),
    "many attributes": (
        urdf("<a " + " ".join(f'a{i}=""' for i in range(100_000)) + "/>"),
        ("100,000 attributes", "64"),
    ),
    "9 MB of comment": (
        urdf("<!--" + " " * 9_000_000 + "-->"),
        ("larger than 8 MB", "meshes in files of their own"),
    ),
    # entities and other files
    "entity bomb": (BOMB, ("DOCTYPE", "delete it")),
    "external entity": (XXE, ("DOCTYPE", "delete it")),
    "remote DTD": (REMOTE, ("DOCTYPE", "delete it")),
    "undefined entity": (urdf(link("&arm;")), ("broken XML", "undefined entity")),
    "XInclude": (
        urdf('<xi:include href="other.urdf" xmlns:xi="http://www.w3.org/2001/XInclude"/>'),
        ("<xi:include>", "one URDF"),
    ),
    "include": (urdf('<include filename="other.urdf"/>'), ("<include>", "one URDF")),
    "mesh that climbs out": (mesh("package://../../etc/passwd"), ("'base'", "climbs out")),
    "mesh that climbs later": (mesh("package://a/../../b.stl"), ("'base'", "climbs out")),
    # other formats
    "xacro macro": (XACRO_HEAD + '<xacro:arm prefix=""/></robot>', ("<xacro:arm>", "expand it")),
    "xacro expression": (origin("${length} 0 0"), ("line 5", "xacro", "expand it")),
    "xacro find": (mesh("$(find arm)/meshes/a.stl"), ("xacro", "expand it")),
    "SDF": ('<sdf version="1.6"><model name="m"/></sdf>', ("<sdf>", "convert")),
    "MuJoCo": ('<mujoco model="m"/>', ("<mujoco>", "convert")),
    "web page": ("<!DOCTYPE html><html></html>", ("DOCTYPE", "web page")),
    "web page without DOCTYPE": ("<html><body/></html>", ("<html>", "raw file")),
    "prefixed robot": ('<u:robot xmlns:u="u"/>', ("<u:robot>", "not a URDF")),
    "JSON": ('{"robot": {}}', ("not XML", "<robot name=...>")),
    "plain text": ("robot test", ("not XML",)),
    "empty": ("", ("is empty", "<robot name=...>")),
    "white space": (" \n\t ", ("is empty",)),
    "comment only": ("<!-- nothing -->", ("broken XML", "no element found")),
    "cut short": (arm()[:200], ("line 5", "broken XML")),
    "two documents": (arm() + arm(), ("broken XML", "junk after")),
    "attribute twice": ('<robot name="a" name="b"/>', ("broken XML", "duplicate attribute")),
    "NUL": (urdf(link("a&#0;b")), ("broken XML",)),
    "PNG": (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", ("binary",)),
    "zip": (b"PK\x03\x04" + bytes(30), ("binary",)),
    "random bytes": (bytes(range(256)), ("binary",)),
    "bad UTF-8": (arm().encode().replace(b"elbow", b"\xff\xfe"), ("line 5", "broken XML")),
    "unknown encoding": (b'<?xml version="1.0" encoding="klingon"?><robot name="r"/>', ("UTF-8",)),
    "multi-byte encoding": (b'<?xml version="1.0" encoding="gb18030"?><robot/>', ("UTF-8",)),
    "UTF-7": (b'<?xml version="1.0" encoding="utf-7"?><robot/>', ("UTF-8",)),
}  # fmt: skip

# name: (URDF, fragments of its warnings); no fragments, no warning
ACCEPTED: dict[str, tuple[str | bytes, tuple[str, ...]]] = {
    "plain": (arm(), ()),
    "one link": (urdf(link("base")), ()),
    "fixed only": (arm(ORIGIN, kind="fixed"), ()),
    "root called universe": (arm(parent="universe").replace('"base"', '"universe"'), ()),
    "no origin": (arm(AXIS + LIMIT), ()),
    "no axis": (arm(ORIGIN + LIMIT), ()),
    "no rpy": (arm('<origin xyz="1 2 3"/>' + AXIS + LIMIT), ()),
    "no xyz": (arm('<origin rpy="1 2 3"/>' + AXIS + LIMIT), ()),
    "numbers in every notation": (origin("+1. -.5 1E-3", "-0 1e-400 1e-310"), ()),
    "axis not normalised": (arm(ORIGIN + '<axis xyz="1 -2 300"/>' + LIMIT), ()),
    "axis negative": (arm(ORIGIN + '<axis xyz="0 0 -1"/>' + LIMIT), ()),
    "fixed with axis zero": (arm(ORIGIN + '<axis xyz="0 0 0"/>', kind="fixed"), ()),
    "fixed with a bad limit": (arm('<limit lower="nan"/>', kind="fixed"), ()),
    "prismatic": (arm(ORIGIN + AXIS + LIMIT, kind="prismatic"), ()),
    "prismatic of kilometres": (
        limit('lower="-2000" upper="2000" effort="1" velocity="1"', "prismatic"),
        (),
    ),
    "continuous": (arm(ORIGIN + AXIS, kind="continuous"), ()),
    "continuous with limits": (arm(kind="continuous"), ("'elbow' is continuous", "ignored")),
    "continuous oblique": (arm('<axis xyz="1 2 3"/>', kind="continuous"), ()),
    "limits of 1e16": (
        limit('lower="-1e16" upper="1e16" effort="1" velocity="1"'),
        ("'elbow'", "read as continuous"),
    ),
    "limit without effort": (limit('lower="-1" upper="1"'), ()),
    "limits in degrees": (
        limit('lower="-180" upper="180" effort="1" velocity="1"'),
        ("'elbow'", "were degrees meant?"),
    ),
    "rpy in degrees": (origin(rpy="90 0 0"), ("'elbow'", "were degrees meant?")),
    "xyz in millimetres": (origin("0 0 400"), ("'elbow'", "were mm meant?")),
    "soft limits": (
        arm(LIMIT + '<safety_controller soft_lower_limit="-0.5" soft_upper_limit="1"/>'),
        ("soft limits", "'elbow'"),
    ),
    "soft limits of nonsense": (
        arm(LIMIT + '<safety_controller soft_lower_limit="x" soft_upper_limit="1"/>'),
        (),
    ),
    "calibration and dynamics": (
        arm(LIMIT + '<calibration rising="nan"/><dynamics damping="x" friction="0"/>'),
        (),
    ),
    "unknown element": (arm(LIMIT + "<paint/>"), ("'elbow'", "<paint>", "ignored")),
    "unknown attribute": (arm('<origin frame="x"/>' + LIMIT), ("'frame'", "ignored")),
    "mimic": (
        arm().replace(
            LIMIT + "</joint>\n</robot>", LIMIT + '<mimic joint="elbow"/></joint></robot>'
        ),
        (),
    ),
    "joint called as its link": (arm(name="arm"), ()),
    "joint called as another link": (arm(name="hand"), ()),
    "names of every kind": (
        arm(name="j &amp; &lt;b&gt; é ü 関節 'q' /\\").replace('"hand"', '"a:b/c d"'),
        (),
    ),
    "extensions": (
        urdf(
            link("base"), link("arm"), joint(),
            '<gazebo reference="arm"><x y="${1}"/></gazebo>', '<transmission name="t"/>',
            '<ros2_control name="c" type="system"><joint name="elbow"/></ros2_control>',
        ),
        (),
    ),
    "inertia of nonsense": (
        urdf(link("base"), link("arm", '<inertial><mass value="nan"/></inertial>'), joint()),
        (),
    ),
    "xacro namespace left over": (arm().replace('<robot name="test">', XACRO_HEAD), ()),
    "default namespace": (arm().replace("<robot ", '<robot xmlns="urdf" '), ()),
    "robot without a name": (arm().replace(' name="test"', ""), ()),
    "declaration and comments": ('<?xml version="1.0"?><!-- a -->' + arm() + "<!-- &x; -->", ()),
    "processing instruction": ('<?xml-stylesheet href="file:///etc/passwd"?>' + arm(), ()),
    "CDATA": (arm().replace("</robot>", "<![CDATA[<link/>]]></robot>"), ()),
    "byte order mark": (b"\xef\xbb\xbf" + arm().encode(), ()),
    "UTF-16": (('<?xml version="1.0" encoding="UTF-16"?>' + arm()).encode("utf-16"), ()),
    "Latin-1": (
        ('<?xml version="1.0" encoding="ISO-8859-1"?>' + arm(name="coude né")).encode("latin-1"),
        (),
    ),
    "chain of 201 links": (chain(201), ()),
    "star of 1,000 links": (star(1000), ()),
    "star of 151 links": (star(151, "prismatic"), ()),
    "mesh missing": (mesh("package://arm/a.stl"), ("'base'", "not found", "package_dirs")),
    "mesh outside": (mesh("file:///etc/passwd.stl"), ("'base'", "outside", "package_dirs")),
    "mesh relative, outside": (mesh("../../../x.stl"), ("'base'", "outside", "package_dirs")),
    "mesh of no mesh format": (mesh("file:///etc/passwd"), ("'base'", "is not one of .stl")),
    "mesh from the network": (mesh("http://127.0.0.1:9/a.stl"), ("'base'", "download")),
    "mesh without a name": (mesh(""), ("'base'", "no usable name")),
    "mesh with a name of 1 MB": (mesh("a/" * 500_000 + ".stl"), ("'base'", "no usable name")),
    "mesh with a name too long for the system": (mesh("a" * 400 + ".stl"), ("not found",)),
    "3,000 shapes": (
        drawn("</visual><visual>".join(['<geometry><sphere radius="1"/></geometry>'] * 3000)),
        ("not drawn: 1,000 shapes over 2,000",),
    ),
    "20,000 unknown elements": (arm(LIMIT + "<paint/>" * 20_000), ("... and 19,900 more",)),
    "40,000 other elements": (urdf(link("base"), *(f"<l{i}/>" for i in range(40_000))), ()),
    "mesh without filename": (drawn("<geometry><mesh/></geometry>"), ("has no filename",)),
    "mesh scale NaN": (mesh("a.stl", ' scale="nan 1 1"'), ("'base'", "3 finite numbers")),
    "mesh scale zero": (mesh("a.stl", ' scale="1 0 1"'), ("'base'", "not zero")),
    "visual without geometry": (drawn(""), ("'base'", "one <geometry>")),
    "visual with two shapes": (
        drawn('<geometry><sphere radius="1"/><box size="1 1 1"/></geometry>'),
        ("'base'", "one shape"),
    ),
    "visual origin NaN": (
        drawn('<origin xyz="nan 0 0"/><geometry><sphere radius="1"/></geometry>'),
        ("'base'", "3 finite numbers"),
    ),
    "box flat": (drawn('<geometry><box size="1 0 1"/></geometry>'), ("'base'", "above zero")),
    "sphere negative": (drawn('<geometry><sphere radius="-1"/></geometry>'), ("above zero",)),
    "cylinder without length": (
        drawn('<geometry><cylinder radius="1"/></geometry>'),
        ("'base'", "has no length"),
    ),
    "shape unknown": (drawn("<geometry><torus/></geometry>"), ("'base'", "<torus>", "no shape")),
}  # fmt: skip
BOTH = 'effort="1" velocity="1"'
MIMIC = LIMIT + '<mimic joint="{}"{}/>'
# name: (URDF in which the joint called elbow has a fault, fragments of that fault)
FAULTY: dict[str, tuple[str, tuple[str, ...]]] = {
    "no limit": (arm(ORIGIN + AXIS), ("no <limit>", "radians")),
    "no limit, prismatic": (arm(ORIGIN + AXIS, kind="prismatic"), ("no <limit>", "metres")),
    "limit without ends": (limit(BOTH), ("without lower and upper", 'lower="..."')),
    "limit without ends, prismatic": (limit(BOTH, "prismatic"), ("without lower and upper",)),
    "limit in other words": (limit('min="-1" max="1" ' + BOTH), ("without lower and upper",)),
    "lower above upper": (limit('lower="1" upper="-1" ' + BOTH), ("[1, -1]", "above upper")),
    "lower equals upper": (limit('lower="0" upper="0" ' + BOTH), ("[0, 0]", "locked")),
    "lower limit only": (limit('lower="-1" ' + BOTH), ("'elbow'", "a <limit> without upper")),
    "upper limit only": (limit('upper="1" ' + BOTH), ("'elbow'", "a <limit> without lower")),
    "limit NaN": (limit('lower="nan" upper="1" ' + BOTH), ("'nan'", "must be 1 finite number")),
    "limit infinite": (limit('lower="-inf" upper="inf" ' + BOTH), ("'-inf'", "1 finite number")),
    "limit of words": (limit('lower="low" upper="high" ' + BOTH), ("'low'", "1 finite number")),
    "limit with a comma": (limit('lower="-1,5" upper="1,5" ' + BOTH), ("'-1,5'", "1 finite")),
    "limit of two numbers": (limit('lower="0 1" upper="2" ' + BOTH), ("'0 1'", "1 finite number")),
    "limit 1e400": (limit('lower="-1" upper="1e400" ' + BOTH), ("'1e400'", "finite")),
    "one limit 1e16": (limit('lower="-1" upper="1e16" ' + BOTH), ("1e+16", "no real stops")),
    "prismatic 1e16": (limit('lower="-1e16" upper="1e16"', "prismatic"), ("no real stops",)),
    "mimics an unknown joint": (arm(MIMIC.format("no", "")), ("unknown joint 'no'", "lock")),
    "mimics itself": (arm(MIMIC.format("elbow", "")), ("mimics itself", "lock")),
    "mimics nothing": (arm(LIMIT + "<mimic/>"), ("<mimic> without joint", "lock")),
    "mimics by NaN": (arm(MIMIC.format("wrist", ' multiplier="nan"')), ("'nan'", "lock")),
    "mimics a fixed joint": (
        arm(MIMIC.format("wrist", "")).replace(
            '"wrist" type="revolute"', '"wrist" type="fixed"'
        ),
        ("'wrist'", "which is fixed"),
    ),
    "mimics in a circle": (
        arm(MIMIC.format("wrist", "")).replace(
            LIMIT + "</joint>\n</robot>", MIMIC.format("elbow", "") + "</joint></robot>"
        ),
        ("mimics itself through other joints",),
    ),
}  # fmt: skip
