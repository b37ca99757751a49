c<!DOCTYPE PickedPoints>
<PickedPoints>
 <point x="10.5" y="20" z="30" active="1" name="1"/>
 <point x="-0.001" y="4" z="5.25" active="1" name="2"/>
 <point x="0" y="0" z="1" active="1" name="3"/>
</PickedPoints>
