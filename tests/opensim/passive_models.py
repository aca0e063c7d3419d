"""A foot and shank with one passive force at a time, as text of an `.osim` file."""

from ..own_models import MODEL, THELEN, body, coordinate, joint, muscle

PATH = """<GeometryPath name="path"><PathPointSet><objects>
<PathPoint name="a"><socket_parent_frame>/bodyset/foot</socket_parent_frame>
<location>0.05 0.02 0.01</location></PathPoint>
<PathPoint name="via"><socket_parent_frame>/bodyset/shank</socket_parent_frame>
<location>0.05 0.1 0.02</location></PathPoint>
<PathPoint name="b"><socket_parent_frame>/ground</socket_parent_frame>
<location>0.04 0.25 0.0</location></PathPoint></objects></PathPointSet>{wraps}</GeometryPath>"""
WRAPS = """<PathWrapSet><objects><PathWrap><wrap_object>ankle</wrap_object></PathWrap></objects>
</PathWrapSet>"""
# Straight: the tangent points of OpenSim's wraps over cylinders are not exact.
STRAIGHT = PATH.format(wraps="")
TWO_POINTS = """<socket_body1>/ground</socket_body1><socket_body2>/bodyset/shank</socket_body2>
<point1>0.1 0.2 -0.1</point1><point2>0.02 0.1 0.03</point2>"""
FRAMES = """<frames>
<PhysicalOffsetFrame name="one"><socket_parent>/bodyset/foot</socket_parent>
<translation>0.01 0.02 0.03</translation><orientation>0.1 0.2 0.3</orientation>
</PhysicalOffsetFrame><PhysicalOffsetFrame name="two"><socket_parent>/bodyset/shank</socket_parent>
<translation>-0.01 0.05 0.02</translation><orientation>-0.2 0.1 0.15</orientation>
</PhysicalOffsetFrame></frames><socket_frame1>one</socket_frame1><socket_frame2>two</socket_frame2>
<rotational_damping>0.5 0.6 0.7</rotational_damping>
<translational_damping>5 6 7</translational_damping>"""
SURFACES = """<ContactGeometrySet><objects>
<ContactHalfSpace name="floor"><socket_frame>/ground</socket_frame><location>0 0.01 0</location>
<orientation>0.05 0.03 -1.5</orientation></ContactHalfSpace>
<ContactSphere name="heel"><socket_frame>/bodyset/foot</socket_frame>
<location>-0.05 -0.02 0.01</location><radius>0.04</radius></ContactSphere>
<ContactSphere name="toe"><socket_frame>/bodyset/foot</socket_frame>
<location>0.09 -0.02 -0.01</location><radius>0.03</radius></ContactSphere>
<ContactSphere name="shin"><socket_frame>/bodyset/shank</socket_frame>
<location>0.03 0.03 0.02</location><radius>0.085</radius></ContactSphere>
</objects></ContactGeometrySet>"""
MATERIAL = """<HuntCrossleyForce::ContactParameters><geometry>{}</geometry><stiffness>{}</stiffness>
<dissipation>{}</dissipation><static_friction>{}</static_friction><dynamic_friction>{}
</dynamic_friction><viscous_friction>{}</viscous_friction></HuntCrossleyForce::ContactParameters>"""

PUSHING = """<PointToPointActuator name="pushing"><bodyA>foot</bodyA><bodyB>shank</bodyB>
<pointA>0.1 0.02 -0.1</pointA><pointB>0.02 0.1 0.03</pointB><optimal_force>7</optimal_force>
<min_control>-1</min_control><max_control>3</max_control></PointToPointActuator>"""
SPAN = 0.05  # of the runs [s]
FORCES = {
    "limit": """<CoordinateLimitForce name="limit"><coordinate>flexion</coordinate>
        <upper_stiffness>20</upper_stiffness><upper_limit>10</upper_limit>
        <lower_stiffness>15</lower_stiffness><lower_limit>-5</lower_limit>
        <damping>0.7</damping><transition>12</transition></CoordinateLimitForce>""",
    "limit_of_position": """<CoordinateLimitForce name="limit"><coordinate>height</coordinate>
        <upper_stiffness>2000</upper_stiffness><upper_limit>0.03</upper_limit>
        <lower_stiffness>1500</lower_stiffness><lower_limit>0.01</lower_limit>
        <damping>3</damping><transition>0.02</transition></CoordinateLimitForce>""",
    "spring": """<SpringGeneralizedForce name="spring"><coordinate>rotation</coordinate>
        <stiffness>12</stiffness><rest_length>0.2</rest_length><viscosity>0.8</viscosity>
        </SpringGeneralizedForce>""",
    "coordinate_formula": """<ExpressionBasedCoordinateForce name="formula">
        <coordinate>flexion</coordinate>
        <expression>-3.5*exp(2*(q-0.1))+2*exp(-4*(q+0.2))-0.3*qdot^3+min(q, 0.1)*sqrt(abs(qdot))
        </expression></ExpressionBasedCoordinateForce>""",
    "path_spring": f"""<PathSpring name="path_spring">{STRAIGHT}
        <resting_length>0.18</resting_length>
        <stiffness>3000</stiffness><dissipation>0.2</dissipation></PathSpring>""",
    "ligament": f"""<Ligament name="ligament">{STRAIGHT}<resting_length>0.2</resting_length>
        <pcsa_force>700</pcsa_force></Ligament>""",
    "ligament_with_a_curve": f"""<Ligament name="ligament">{STRAIGHT}
        <resting_length>0.2</resting_length><pcsa_force>700</pcsa_force>
        <SimmSpline name="force_length_curve"><x>-5 0.998 0.999 1 1.1 1.3 1.5 2 5</x>
        <y>0 0 0 0 0.05 0.3 1.2 2 3</y></SimmSpline></Ligament>""",
    "blankevoort": f"""<Blankevoort1991Ligament name="blankevoort">{STRAIGHT}
        <linear_stiffness>4000</linear_stiffness><transition_strain>0.05</transition_strain>
        <damping_coefficient>2.5</damping_coefficient><slack_length>0.21</slack_length>
        </Blankevoort1991Ligament>""",
    "wrapped": f"""<PathSpring name="wrapped">{PATH.format(wraps=WRAPS)}
        <resting_length>0.18</resting_length><stiffness>3000</stiffness>
        <dissipation>0</dissipation></PathSpring>""",
    "function_path": """<PathSpring name="function_path"><FunctionBasedPath name="path">
        <coordinate_paths>/jointset/ankle_joint/flexion /jointset/ground_foot/rotation
        </coordinate_paths><length_function><MultivariatePolynomialFunction>
        <coefficients>0.3 0.02 -0.01 0.04 -0.03 0.05</coefficients><dimension>2</dimension>
        <order>2</order></MultivariatePolynomialFunction></length_function></FunctionBasedPath>
        <resting_length>0.2</resting_length><stiffness>3000</stiffness>
        <dissipation>0.2</dissipation></PathSpring>""",
    "two_points": f"""<PointToPointSpring name="two_points">{TWO_POINTS}
        <stiffness>900</stiffness><rest_length>0.25</rest_length></PointToPointSpring>""",
    "point_formula": """<ExpressionBasedPointToPointForce name="formula"><body1>/ground</body1>
        <body2>/bodyset/shank</body2><point1>0.1 0.2 -0.1</point1><point2>0.02 0.1 0.03</point2>
        <expression>100*(d-0.2)+5*ddot*step(ddot)</expression></ExpressionBasedPointToPointForce>""",
    "bushing": f"""<BushingForce name="bushing">{FRAMES}
        <rotational_stiffness>10 20 30</rotational_stiffness>
        <translational_stiffness>1000 2000 3000</translational_stiffness></BushingForce>""",
    "bushing_formula": f"""<ExpressionBasedBushingForce name="bushing">{FRAMES}
        <Mx_expression>10*theta_x+5*theta_x^3</Mx_expression>
        <My_expression>20*theta_y*(1+theta_z)</My_expression>
        <Mz_expression>30*sin(theta_z)</Mz_expression><Fx_expression>1e3*delta_x</Fx_expression>
        <Fy_expression>2e3*delta_y+delta_x*theta_y</Fy_expression>
        <Fz_expression>3e3*tanh(delta_z)</Fz_expression></ExpressionBasedBushingForce>""",
    "bushing_functions": f"""<FunctionBasedBushingForce name="bushing">{FRAMES}
        <m_x_theta_x_function><LinearFunction><coefficients>10 0.2</coefficients></LinearFunction>
        </m_x_theta_x_function><m_y_theta_y_function><SimmSpline><x>-1 -0.2 0 0.3 1</x>
        <y>-30 -5 0 4 20</y></SimmSpline></m_y_theta_y_function><m_z_theta_z_function>
        <PolynomialFunction><coefficients>40 0 20 0</coefficients></PolynomialFunction>
        </m_z_theta_z_function><f_x_delta_x_function><PiecewiseLinearFunction><x>-1 0 0.1 1</x>
        <y>-1000 0 50 900</y></PiecewiseLinearFunction></f_x_delta_x_function>
        <f_z_delta_z_function><Constant><value>7</value></Constant></f_z_delta_z_function>
        </FunctionBasedBushingForce>""",
    "smooth_contact": """<SmoothSphereHalfSpaceForce name="smooth">
        <socket_sphere>/contactgeometryset/heel</socket_sphere>
        <socket_half_space>/contactgeometryset/floor</socket_half_space>
        <stiffness>3067776</stiffness><dissipation>2</dissipation>
        <static_friction>0.8</static_friction><dynamic_friction>0.7</dynamic_friction>
        <viscous_friction>0.5</viscous_friction><transition_velocity>0.2</transition_velocity>
        </SmoothSphereHalfSpaceForce>""",
    "spheres": f"""<HuntCrossleyForce name="contact">
        <HuntCrossleyForce::ContactParametersSet name="contact_parameters"><objects>
        {MATERIAL.format("shin", 3e5, 0.5, 0.9, 0.8, 0.4)}
        {MATERIAL.format("heel toe", 1e5, 0.8, 0.7, 0.6, 0.3)}</objects>
        </HuntCrossleyForce::ContactParametersSet><transition_velocity>0.13</transition_velocity>
        </HuntCrossleyForce>""",
    "hunt_crossley": f"""<HuntCrossleyForce name="contact">
        <HuntCrossleyForce::ContactParametersSet name="contact_parameters"><objects>
        {MATERIAL.format("floor", 5e6, 1.5, 0.9, 0.8, 0.4)}
        {MATERIAL.format("heel toe", 1e6, 2.0, 0.7, 0.6, 0.3)}</objects>
        </HuntCrossleyForce::ContactParametersSet><transition_velocity>0.13</transition_velocity>
        </HuntCrossleyForce>""",
}  # fmt: skip


def model(*names, muscles=True):
    """The text of a model with these forces; OpenSim's is without muscles."""
    surfaces = """<WrapObjectSet><objects><WrapCylinder name="ankle"><radius>0.03</radius>
    <length>0.4</length><translation>0.02 0.05 0</translation></WrapCylinder></objects>
    </WrapObjectSet>"""
    planar = "".join(
        coordinate(name, low, high)
        for name, low, high in (
            ("rotation", -0.4, 0.4),
            ("advance", -0.3, 0.3),
            ("height", 0, 0.06),
        )
    )
    three = "".join(
        coordinate(name, low, high)
        for name, low, high in (("flexion", -0.5, 0.5), ("tilt", -0.3, 0.3), ("twist", -0.4, 0.4))
    )
    pulling = muscle(
        THELEN, "soleus", [("foot", "-0.05 0 0"), ("shank", "-0.03 0.3 0")], 900, 0.1, 0.2
    )
    text = MODEL.format(
        name="passive",
        bodies=body("foot", 1.2, "0.02 0.01 0.005", "0.002 0.003 0.004 0.0001 0 0.0002", surfaces)
        + body("shank", 3.1, "0.01 0.2 0.01", "0.04 0.005 0.04 0 0.0003 0"),
        joints=joint("PlanarJoint", "ground_foot", "ground", "foot", planar, at="0 0.02 0")
        + joint(
            "GimbalJoint", "ankle_joint", "foot", "shank", three, at="0.005 0.04 0",
            turned="0.05 0.1 0",
        ),
        constraints="",
        forces=(pulling if muscles else "") + "".join(FORCES[name] for name in names),
    )  # fmt: skip
    return text.replace("</Model>", f"{SURFACES}</Model>")
